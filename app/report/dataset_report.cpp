#include "app/report/dataset_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/target_names.hpp"
#include "app/dataset/picture_file.hpp"
#include "app/report/html.hpp"
#include "app/report/sections.hpp"

namespace firstlook {
namespace {

/// A picture for the page; none where there is no readable file, since corners may come without their images.
GrayPicture picture_of(const std::filesystem::path& file, const CameraIntrinsics& camera) {
  auto pixels = read_gray_image(file);
  if (!pixels || pixels->width != camera.width || pixels->height != camera.height) return {};
  return {pixels->width, pixels->height, std::move(pixels->pixels)};
}

CalibrationViewRecord record_of_view(const CalibrationDataset& data, const HandEyeResult& result, std::size_t i) {
  const CalibrationView& view = data.views[i];
  const BoardSpec& board = data.targets[static_cast<std::size_t>(view.target)].board;
  const TargetPose& target = result.targets[static_cast<std::size_t>(view.target)];
  CalibrationViewRecord r;
  r.name = data.names[i];
  r.base_T_flange = view.base_T_flange;
  r.detected_px = view.corners_px;
  r.detected_ids = view.ids;
  r.used = result.fits[i].used;
  if (i < result.holdout_px.size()) r.holdout_px = result.holdout_px[i];
  if (target.views == 0) return r;
  const auto camera_T_board = (view.base_T_flange * result.flange_T_camera).inverse() * target.base_T_board;
  double squared = 0;
  for (std::size_t c = 0; c < view.corners_px.size(); ++c) {
    const auto pixel = project(data.camera, camera_T_board * board.corner(point_of(view.ids, c)));
    r.reprojected_px.push_back(pixel.value_or(Eigen::Vector2d(-1, -1)));
    squared += (view.corners_px[c] - r.reprojected_px.back()).squaredNorm();
  }
  r.rms_px = std::sqrt(squared / (2.0 * static_cast<double>(std::max<std::size_t>(1, view.corners_px.size()))));
  return r;
}

std::string data_text(const CalibrationDataset& data) {
  if (data.source == CalibrationSource::kPairs) return fmt::format("{} pose pairs", data.pairs.size());
  return fmt::format("{}; {}", views_text(data),
                     data.source == CalibrationSource::kImages ? "corners found in the images" : "corners as given");
}

std::string data_section(const CalibrationDataset& data, bool intrinsics_estimated) {
  std::string body = paragraph(data_text(data) + ".");
  if (data.source != CalibrationSource::kPairs) {
    const CameraIntrinsics& c = data.camera;
    body += paragraph(fmt::format(
        "Camera {}x{}: fx {:.1f}, fy {:.1f}, cx {:.1f}, cy {:.1f} px, {}.", c.width, c.height, c.fx, c.fy, c.cx, c.cy,
        intrinsics_estimated ? "estimated from the same views together with the rest" : "as camera_info.yaml says"));
  }
  for (const std::string& note : data.notes) body += paragraph(note + ".");
  return section("data", "What it was solved from", body);
}

/// "25 of 26 views", "7 of 8 pose pairs", "16 of 16 views of 2 targets at 12 places of the arm".
std::string solved_from_text(const HandEyeResult& result) {
  const auto used = std::count_if(result.fits.begin(), result.fits.end(), [](const ViewFit& fit) { return fit.used; });
  std::string text = fmt::format("{} of {} {}", used, result.fits.size(), result.from_pairs ? "pose pairs" : "views");
  if (result.targets.size() < 2) return text;
  return text + fmt::format(" of {} targets at {} places of the arm", result.targets.size(), result.views);
}

/// What each view is off by, in pixels and as a deviation of the arm.
std::string view_table(const RunRecord& record, const CalibrationDataset& data) {
  const HandEyeResult& h = *record.hand_eye;
  HtmlTable table({"view", "", "RMS px, arm granted its deviation", "RMS px as predicted", "held out px", "arm off mm",
                   "arm off mrad"},
                  2);
  for (std::size_t i = 0; i < h.fits.size(); ++i) {
    const ViewFit& fit = h.fits[i];
    const bool corners = i < record.calibration_views.size();
    const auto px = [&](double value) { return corners ? fmt::format("{:.3f}", value) : std::string(); };
    std::vector<std::string> cells = {data.names[i], fit.used ? "" : "left out: contradicts the others"};
    cells.push_back(fit.used ? px(fit.reprojection_rms_px) : "");
    cells.push_back(corners ? px(record.calibration_views[i].rms_px) : "");
    const bool held_out = corners && record.calibration_views[i].holdout_px;
    cells.push_back(held_out ? px(*record.calibration_views[i].holdout_px) : "");
    cells.push_back(fit.used ? fmt::format("{:.3f}", fit.arm_deviation.head<3>().norm() * 1e3) : "");
    cells.push_back(fit.used ? fmt::format("{:.3f}", fit.arm_deviation.tail<3>().norm() * 1e3) : "");
    table.row(cells);
  }
  return section("residuals", "How far each view is off", "<div class=\"scroll\">" + table.html("dense") + "</div>\n");
}

}  // namespace

std::string views_text(const CalibrationDataset& data) {
  if (data.targets.size() == 1) return fmt::format("{} views of a board: {}", data.views.size(), describe(data.board));
  std::string text = fmt::format("{} views of {} targets", data.views.size(), data.targets.size());
  for (const NamedTarget& target : data.targets) text += fmt::format("; {}: {}", target.name, describe(target.board));
  return text;
}

RunRecord record_of_dataset(const std::filesystem::path& folder, const CalibrationDataset& data,
                            const HandEyeResult& result, const HandEyeOptions& options) {
  RunRecord record;
  const bool accepted = result.verdict == Verdict::kAccepted;
  record.outcome = accepted ? Outcome::kDone : Outcome::kCalibrationRejected;
  record.reason =
      fmt::format("hand-eye calibration {} from {}", accepted ? "accepted" : "rejected", solved_from_text(result));
  record.seed = static_cast<std::int64_t>(options.seed);
  record.hand_eye = result;
  record.solver = solver_name(options.solver);
  const bool pairs = data.source == CalibrationSource::kPairs;
  const std::vector<PosePair> used =
      pairs ? used_pairs(data.pairs, result) : used_pairs(data.camera, boards_of(data.targets), data.views, result);
  record.comparison = compare_solvers(used, result, options);
  if (pairs) return record;
  record.intrinsics = data.camera;
  if (data.targets.size() > 1) {
    for (const NamedTarget& target : data.targets) record.target_names.push_back(target.name);
  }
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    record.calibration_views.push_back(record_of_view(data, result, i));
    if (i < kViewsShownMax) record.calibration_views.back().picture = picture_of(folder / data.images[i], data.camera);
  }
  return record;
}

std::string dataset_report_html(const RunRecord& record, const CalibrationDataset& data) {
  const std::string name = escape_html(record.cell);
  std::string html = page_head("firstlook calibration: " + name);
  html += fmt::format(
      "<body>\n<main>\n<header><h1>Calibration from {}</h1><span class=\"brand\">firstlook {} · "
      "report</span></header>\n",
      name, escape_html(record.provenance.version));
  html += "<nav><a href=\"#hand-eye\">Hand-eye</a>";
  if (record.hand_eye->touch_test) html += "<a href=\"#touch-test\">Touch test</a>";
  html += "<a href=\"#residuals\">Residuals</a>";
  if (!record.calibration_views.empty()) html += "<a href=\"#calibration-views\">Views</a>";
  html += "<a href=\"#solvers\">Solvers</a><a href=\"#data\">Data</a></nav>\n";
  html += summary_section(record) + hand_eye_section(record) + touch_test_section(record);
  html += targets_section(record) + view_table(record, data);
  html += calibration_views_section(record) + solver_comparison_section(record) +
          data_section(data, record.hand_eye->intrinsics.has_value());
  return html + "</main>\n</body>\n</html>\n";
}

}  // namespace firstlook
