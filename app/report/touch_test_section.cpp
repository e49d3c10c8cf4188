/// The touch test in the report: the corners touched, and the camera's error in each view (thesis, section 8-4).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "algorithms/vision/rotation.hpp"
#include "app/report/html.hpp"
#include "app/report/sections.hpp"
#include "app/report/svg.hpp"

namespace firstlook {
namespace {

using svg::line, svg::text_at;

constexpr std::array<std::string_view, 3> kAxes = {"x", "y", "z"};
constexpr std::array<std::string_view, 3> kColours = {svg::kBlue, svg::kOrange, svg::kGreen};

/// The errors of all views in three of the six coordinates, zero in the middle, with the mean and its expected sigma.
std::string error_chart(const TouchTest& test, Eigen::Index first, std::string_view unit, std::string_view label) {
  constexpr double kLeft = 56, kTop = 22, kWidth = 420, kHalf = 110;
  double top = 1e-3;
  for (const CameraError& e : test.errors) top = std::max(top, 1e3 * e.segment<3>(first).cwiseAbs().maxCoeff());
  const double step = svg::nice_step(top, 3), shown = step * std::ceil(top / step);
  const auto y = [&](double value) { return kTop + kHalf - value / shown * kHalf; };
  const auto count = static_cast<double>(std::max<std::size_t>(1, test.errors.size()));
  std::string svg = svg::open(560, 285, label);
  for (int i = static_cast<int>(-shown / step); i <= static_cast<int>(shown / step); ++i) {
    svg += line(kLeft, y(step * i), kLeft + kWidth, y(step * i), i == 0 ? "axis" : "grid");
    svg += text_at(kLeft - 6, y(step * i) + 4, "end", fmt::format("{:.3g}", step * i));
  }
  svg += text_at(kLeft - 46, 12, "start", unit, "class=\"note\"");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto at = first + static_cast<Eigen::Index>(axis);
    std::string points;
    for (std::size_t i = 0; i < test.errors.size(); ++i) {
      const double x = kLeft + (static_cast<double>(i) + 0.5 + 0.15 * (static_cast<double>(axis) - 1)) / count * kWidth;
      points += fmt::format("M{:.1f} {:.1f}h0", x, y(1e3 * test.errors[i][at]));
    }
    svg += fmt::format("<path class=\"dots\" style=\"stroke-width:6;stroke-opacity:.8\" stroke=\"{}\" d=\"{}\"/>\n",
                       kColours[axis], points);
    const double mean = 1e3 * test.mean[at], sigma = 1e3 * test.mean_sigma[at];
    const double x = kLeft + kWidth + 14 + 24 * static_cast<double>(axis);
    svg += fmt::format("<path class=\"line\" stroke=\"{0}\" d=\"M{1:.1f} {2:.1f}V{3:.1f}M{4:.1f} {5:.1f}H{6:.1f}\"/>\n",
                       kColours[axis], x, y(std::clamp(mean - sigma, -shown, shown)),
                       y(std::clamp(mean + sigma, -shown, shown)), x - 5, y(std::clamp(mean, -shown, shown)), x + 5);
    svg += text_at(x, kTop + 2 * kHalf + 18, "middle", kAxes[axis]);
  }
  svg += text_at(kLeft + kWidth / 2, kTop + 2 * kHalf + 18, "middle", "view", "class=\"note\"");
  svg += text_at(kLeft + kWidth + 38, kTop + 2 * kHalf + 36, "middle", "mean ± 1σ", "class=\"note\"");
  return svg + "</svg>\n";
}

std::string error_table(const TouchTest& test) {
  HtmlTable table({"the camera's error, in its own axes", "mean", "± 1σ expected", "std over views", "std static"}, 1);
  for (std::size_t i = 0; i < 6; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const auto cell = [&](bool known, double value) { return known ? fmt::format("{:.3f}", value * 1e3) : "—"; };
    table.row({fmt::format("{} {}, {}", i < 3 ? "along" : "about", kAxes[i % 3], i < 3 ? "mm" : "mrad"),
               cell(true, test.mean[at]), cell(true, test.mean_sigma[at]),
               cell(test.places > 1, test.view_deviation[at]), cell(test.static_looks > 0, test.static_deviation[at])});
  }
  const Eigen::Vector3d rpy = roll_pitch_yaw(rotation_exp(test.mean.tail<3>())) * (180 / std::numbers::pi);
  return table.html() +
         paragraph(fmt::format("Roll, pitch, yaw of the mean: {:.3f}, {:.3f}, {:.3f} degrees. {} places "
                               "of the arm; {} repeated looks from one place.",
                               rpy.x() + 0.0, rpy.y() + 0.0, rpy.z() + 0.0, test.places, test.static_looks));
}

std::string touch_table(const TouchedBoard& board) {
  HtmlTable table({"touched", "", "off x mm", "off y mm", "off z mm", "distance mm"}, 2);
  for (const TouchFit& fit : board.fits) {
    std::string remark;
    if (!fit.used) remark = fit.rather ? "left out: the tip stood on " + fit.rather_name : "left out: it slipped";
    const Eigen::Vector3d off = fit.off_m * 1e3;
    table.row({fit.name, remark, fmt::format("{:.2f}", off.x() + 0.0), fmt::format("{:.2f}", off.y() + 0.0),
               fmt::format("{:.2f}", off.z() + 0.0), fmt::format("{:.2f}", off.norm())});
  }
  return "<div class=\"scroll\">" + table.html("dense") + "</div>\n";
}

std::string figures_table(const TouchTest& test) {
  const TouchedBoard& b = test.board;
  const Eigen::Vector3d tip = b.flange_p_tip_m * 1e3, sigma = b.tip_sigma_m * 1e3;
  HtmlTable table({"figure", "value", "what it says"}, 3);
  table.row(
      {"board, touched against seen",
       fmt::format("{:.2f} mm, {:.2f} mrad", test.shift.head<3>().norm() * 1e3, test.shift.tail<3>().norm() * 1e3),
       fmt::format("χ² {:.1f} by both covariances, allowed {:.1f}; one right calibration in 1000 exceeds it", test.chi2,
                   test.chi2_limit)});
  table.row({"touches against the board",
             fmt::format("{:.2f} mm RMS, {:.2f} mm at most", b.horn_residual_rms_m * 1e3, b.residual_max_m * 1e3),
             fmt::format("after Horn's absolute orientation of {} of {} touches; a touch errs by {:.2f} mm each axis",
                         b.used, b.fits.size(), b.touch_sigma_m * 1e3)});
  table.row({"tip on the flange",
             fmt::format("({:.2f}, {:.2f}, {:.2f}) ± ({:.2f}, {:.2f}, {:.2f}) mm", tip.x(), tip.y(), tip.z(), sigma.x(),
                         sigma.y(), sigma.z()),
             b.tip_estimated ? "estimated from the touches" : "as given, with what the touches say of it"});
  table.row({"size of the board", fmt::format("{:.4f} ± {:.4f}", b.scale, b.scale_sigma),
             "distances between the touches over those of the board's points"});
  return table.html();
}

}  // namespace

std::string touch_test_section(const RunRecord& record) {
  if (!record.hand_eye || !record.hand_eye->touch_test) return {};
  const TouchTest& test = *record.hand_eye->touch_test;
  std::string body = paragraph(
      "The arm's tip was led onto corners of the board by hand. That tells where the board is without the camera, and "
      "so where the camera was in each view, against where the hand-eye transform puts it.");
  body += figures_table(test) + "<h3>Where the camera is off</h3>\n" + error_table(test);
  body += "<div class=\"maps\">" + error_chart(test, 0, "mm", "Translation errors of the camera in each view") +
          error_chart(test, 3, "mrad", "Rotation errors of the camera in each view") + "</div>\n";
  body += "<h3>The touches</h3>\n" + touch_table(test.board);
  return section("touch-test", "Touch test", body);
}

}  // namespace firstlook
