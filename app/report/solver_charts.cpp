/// Box plots of what every solver makes of random parts of the views.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/report/charts.hpp"
#include "app/report/html.hpp"
#include "app/report/sections.hpp"
#include "app/report/svg.hpp"

namespace firstlook {
namespace {

using svg::kBlue, svg::kGreen, svg::kOrange;
using svg::line, svg::nice_step, svg::text_at;

constexpr double kRow = 19, kTop = 34, kNames = 178, kRight = 1000, kGap = 26;
constexpr double kDegrees = 180.0 / std::numbers::pi;

struct Scale {
  double factor;
  std::string_view unit;
};

Scale scale_of(PoseFigure figure) {
  if (figure <= PoseFigure::kZ) return {1e3, "mm"};
  if (figure <= PoseFigure::kYaw) return {kDegrees, "degrees"};
  return {1, ""};
}

const BoxFigures& box_of(const SubsetSolves& solves, PoseFigure figure) {
  return solves.boxes[static_cast<std::size_t>(figure)];
}

std::string_view colour_of(std::string_view solver) {
  const auto known = find_solver(solver);
  if (!known) return kOrange;
  return solver_row(*known).equation == SolverEquation::kAxXb ? kBlue : kGreen;
}

/// One figure of all solvers: where its panel lies, and the values at its rims (in the figure's SI unit).
struct Panel {
  PoseFigure figure;
  double left, width, low, high;
  [[nodiscard]] double x(double value) const {
    return left + std::clamp((value - low) / (high - low), 0.0, 1.0) * width;
  }
  [[nodiscard]] bool shows(double value) const { return value >= low && value <= high; }
};

/// All of the refinement and the whiskers of four of five solvers lie inside, around the refinement's median.
Panel panel_of(const SolverComparison& comparison, PoseFigure figure, double left, double width) {
  constexpr double kShare = 0.8, kRim = 1.15;
  const double middle = box_of(comparison.solvers.front(), figure).median;
  std::vector<double> reaches;
  for (const SubsetSolves& s : comparison.solvers) {
    const BoxFigures& b = box_of(s, figure);
    if (s.solved > 0) reaches.push_back(std::max(middle - b.whisker_low, b.whisker_high - middle));
  }
  std::sort(reaches.begin(), reaches.end());
  double reach =
      reaches.empty() ? 0 : reaches[static_cast<std::size_t>(kShare * static_cast<double>(reaches.size() - 1))];
  const BoxFigures& own = box_of(comparison.solvers.front(), figure);
  reach = std::max({reach, middle - own.minimum, own.maximum - middle});
  reach = std::max(kRim * reach, 1e-9 * std::max(1.0, std::abs(middle)));
  return {figure, left, width, middle - reach, middle + reach};
}

std::string axis(const Panel& panel, double bottom) {
  const auto [factor, unit] = scale_of(panel.figure);
  const double step = nice_step((panel.high - panel.low) * factor, static_cast<int>(panel.width / 55));
  const int digits = std::clamp(-static_cast<int>(std::floor(std::log10(step) + 1e-9)), 0, 12);
  std::string text = text_at(panel.left + panel.width / 2, 14, "middle",
                             fmt::format("{}{}{}", name_of(panel.figure), unit.empty() ? "" : ", ", unit));
  for (double v = step * std::ceil(panel.low * factor / step); v <= panel.high * factor; v += step) {
    const double x = panel.x(v / factor);
    text += line(x, kTop - 6, x, bottom, "grid");
    text += text_at(x, bottom + 15, "middle", fmt::format("{:.{}f}", v + 0.0, digits), "class=\"note\"");
  }
  const double middle = panel.left + panel.width / 2;
  return text + line(middle, kTop - 6, middle, bottom, "mark") +
         line(panel.left, bottom, panel.left + panel.width, bottom, "axis");
}

std::string arrow(double x, double y, double way, std::string_view colour) {
  return fmt::format("<path fill=\"{}\" d=\"M{:.1f} {:.1f}l{:.1f} -4v8z\"/>\n", colour, x, y, -6 * way);
}

std::string box(const Panel& panel, const SubsetSolves& solves, double y) {
  if (solves.solved == 0)
    return text_at(panel.left + panel.width / 2 + 4, y + 4, "start", "none solved", "class=\"note\"");
  const std::string_view colour = colour_of(solves.solver);
  const BoxFigures& b = box_of(solves, panel.figure);
  const double low = panel.x(b.whisker_low), high = panel.x(b.whisker_high);
  const double left = panel.x(b.quartile_low), right = panel.x(b.quartile_high);
  std::string text =
      fmt::format("<path stroke=\"{}\" fill=\"none\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>\n", colour, low, y, high);
  text += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"11\" fill=\"{}\" fill-opacity=\".35\" "
      "stroke=\"{}\"/>\n",
      left, y - 5.5, std::max(0.6, right - left), colour, colour);
  if (panel.shows(b.median)) {
    text += fmt::format("<path stroke=\"{}\" stroke-width=\"2\" d=\"M{:.1f} {:.1f}v11\"/>\n", colour, panel.x(b.median),
                        y - 5.5);
  }
  std::string dots;
  for (const double value : b.outliers) {
    if (panel.shows(value)) dots += fmt::format("M{:.1f} {:.1f}h0", panel.x(value), y);
  }
  if (!dots.empty()) text += fmt::format("<path class=\"dots\" stroke=\"{}\" d=\"{}\"/>\n", colour, dots);
  if (b.minimum < panel.low) text += arrow(panel.left, y, -1, colour);
  if (b.maximum > panel.high) text += arrow(panel.left + panel.width, y, 1, colour);
  return text;
}

/// How far apart the largest and the smallest value of each figure are, as the thesis compares them.
std::string range_table(const SolverComparison& comparison) {
  HtmlTable table({"solver", "paper", "x mm", "y mm", "z mm", "roll °", "pitch °", "yaw °", "not solved"}, 2);
  for (const SubsetSolves& s : comparison.solvers) {
    const auto known = find_solver(s.solver);
    std::vector<std::string> cells = {
        std::string(s.solver),
        known ? fmt::format("{} {}", solver_row(*known).paper, solver_row(*known).year) : "this program's own result"};
    for (std::size_t i = 0; i < 6; ++i) {
      const BoxFigures& b = s.boxes[i];
      const double range = (b.maximum - b.minimum) * (i < 3 ? 1e3 : kDegrees);
      cells.push_back(s.solved == 0 ? "" : fmt::format("{:.{}f}", range, i < 3 ? 2 : 3));
    }
    cells.push_back(s.failed == 0 ? "" : fmt::format("{}", s.failed));
    table.row(cells);
  }
  return table.html("dense");
}

std::string failures(const SolverComparison& comparison) {
  std::string html;
  for (const SubsetSolves& s : comparison.solvers) {
    if (s.failed == 0 || s.first_failure.empty()) continue;
    html += paragraph(fmt::format("{}, not solved {} times: {}", s.solver, s.failed, s.first_failure));
  }
  return html;
}

}  // namespace

std::string solver_box_chart(const SolverComparison& comparison, std::span<const PoseFigure> figures,
                             std::string_view label) {
  if (comparison.solvers.empty() || figures.empty()) return {};
  const double bottom = kTop + kRow * static_cast<double>(comparison.solvers.size());
  const auto panels = static_cast<double>(figures.size());
  const double width = (kRight - kNames - kGap * panels) / panels;
  std::string text = svg::open(kRight + 10, bottom + 24, label);
  const auto y = [](std::size_t row) { return kTop + kRow * (static_cast<double>(row) + 0.5); };
  for (std::size_t row = 0; row < comparison.solvers.size(); ++row) {
    text += text_at(kNames - 4, y(row) + 4, "end", comparison.solvers[row].solver);
  }
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const double left = kNames + kGap / 2 + static_cast<double>(i) * (width + kGap);
    const Panel panel = panel_of(comparison, figures[i], left, width);
    text += axis(panel, bottom);
    for (std::size_t row = 0; row < comparison.solvers.size(); ++row)
      text += box(panel, comparison.solvers[row], y(row));
  }
  return text + "</svg>\n";
}

std::string solver_comparison_section(const RunRecord& record) {
  if (!record.comparison) return {};
  const SolverComparison& c = *record.comparison;
  std::string body = paragraph(fmt::format(
      "{} random parts of the views, {} of {} each, the same for every solver; the refinement solved {} of them.{} "
      "Boxes hold the middle half of the results, lines reach to the farthest within 1.5 boxes, dots lie beyond, an "
      "arrow points to what the panel does not show. The dashed line is the refinement's median.",
      c.subsets, c.views_of_solve, c.views, c.refined_subsets,
      c.subsets < c.refined_subsets ? " The solvers got fewer because the time of a solve grows with the square of the "
                                      "number of views."
                                    : ""));
  body += fmt::format(
      "<p class=\"hint\"><b style=\"color:{}\">■</b> refinement: least squares over all corners, the arm's deviations "
      "and "
      "the board · <b style=\"color:{}\">■</b> AX = XB · <b style=\"color:{}\">■</b> AX = YB. A narrow box is not yet "
      "an "
      "accurate one: an error that all views share, such as a wrong size of the squares, moves all of them "
      "together.</p>\n",
      kOrange, kBlue, kGreen);
  using enum PoseFigure;
  constexpr std::array kPosition = {kX, kY, kZ}, kAngles = {kRoll, kPitch, kYaw};
  constexpr std::array kQuaternion = {kQx, kQy, kQz, kQw};
  body += "<h3>Position of the camera in the flange</h3>\n" + solver_box_chart(c, kPosition, "Position by solver");
  body += "<h3>Rotation as roll, pitch and yaw</h3>\n" + solver_box_chart(c, kAngles, "Roll, pitch and yaw by solver");
  body += "<h3>Rotation as a quaternion</h3>\n" + solver_box_chart(c, kQuaternion, "Quaternion by solver");
  body += "<h3>Largest less smallest value</h3>\n<div class=\"scroll\">" + range_table(c) + "</div>\n" + failures(c);
  return section("solvers", "Every solver on parts of the views", body);
}

}  // namespace firstlook
