#include "app/report/run_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/report/report_html.hpp"
#include "app/report/result_json.hpp"
#include "app/report/ros_files.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

/// hand_eye.yaml: the calibration for people and programs without ROS.
std::string hand_eye_yaml(const HandEyeResult& result) {
  const Eigen::Vector3d t = result.flange_T_camera.translation();
  Eigen::Quaterniond q = result.flange_T_camera.quaternion().normalized();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const Eigen::Vector3d sigma_mm = result.sigma_translation_m * 1e3;
  const Eigen::Vector3d sigma_mrad = result.sigma_rotation_rad * 1e3;
  const std::string holdout_px = result.holdout_rms_m > 0 ? fmt::format("{}", result.holdout_rms_px) : "null";
  std::string covariance;
  for (int i = 0; i < 6; ++i) {
    covariance += i == 0 ? "\n  [" : ",\n   ";
    for (int j = 0; j < 6; ++j) covariance += fmt::format("{}{}", j == 0 ? "" : ", ", result.covariance(i, j));
  }
  return fmt::format(
      "# Pose of the camera in the flange: p_flange = R p_camera + t. Metres; quaternion x y z w.\n"
      "verdict: {}\n"
      "parent_frame: {}\n"
      "child_frame: {}\n"
      "translation_m: [{}, {}, {}]\n"
      "quaternion_xyzw: [{}, {}, {}, {}]\n"
      "sigma_translation_mm: [{}, {}, {}]\n"
      "sigma_rotation_mrad: [{}, {}, {}]\n"
      "# 6 x 6, row by row: translation m, rotation rad; left perturbation in the parent frame.\n"
      "covariance:{}]\n"
      "views: {}\n"
      "reprojection_rms_px: {}\n"
      "holdout_rms_px: {}\n"
      "usable_distance_m: {}\n",
      result.verdict == Verdict::kAccepted ? "accepted" : "rejected", kFlangeFrame, kCameraFrame, t.x(), t.y(), t.z(),
      q.x(), q.y(), q.z(), q.w(), sigma_mm.x(), sigma_mm.y(), sigma_mm.z(), sigma_mrad.x(), sigma_mrad.y(),
      sigma_mrad.z(), covariance, result.views, result.reprojection_rms_px, holdout_px, result.usable_distance_m);
}

/// A rejected calibration stays readable in hand_eye.yaml, but nothing that a robot would load is made of it.
std::vector<NamedFile> files_of_calibration(const RunRecord& record) {
  std::vector<NamedFile> files;
  if (record.intrinsics.width > 0) files.push_back({"camera_info.yaml", camera_info_yaml(record.intrinsics)});
  if (!record.hand_eye) return files;
  files.push_back({"hand_eye.yaml", hand_eye_yaml(*record.hand_eye)});
  if (record.hand_eye->verdict != Verdict::kAccepted) return files;
  for (NamedFile& file : ros_calibration_files(record.hand_eye->flange_T_camera)) {
    files.push_back({"ros/" + file.name, std::move(file.text)});
  }
  return files;
}

std::vector<NamedFile> files_of_map(const MapFiles& map) {
  std::vector<NamedFile> files;
  if (!map.collision_map_bt.empty()) files.push_back({"collision_map.bt", map.collision_map_bt});
  if (!map.map_ot.empty()) files.push_back({"map.ot", map.map_ot});
  if (!map.map_ply.empty()) files.push_back({"map.ply", map.map_ply});
  if (map.occupied.empty()) return files;
  for (NamedFile& file : ros_scene_files(map.occupied)) files.push_back({"ros/" + file.name, std::move(file.text)});
  return files;
}

Status write_files(const std::string& folder, const std::vector<NamedFile>& files) {
  const bool ros =
      std::any_of(files.begin(), files.end(), [](const NamedFile& f) { return f.name.starts_with("ros/"); });
  if (ros) {
    if (Status status = make_directories(folder + "/ros"); !status) return status;
  }
  for (const NamedFile& file : files) {
    if (Status status = write_file_atomically(folder + "/" + file.name, file.text); !status) return status;
  }
  return {};
}

}  // namespace

Status check_run_folder(const std::string& folder) {
  const Result<bool> empty = folder_is_empty(folder);
  if (!empty) return std::unexpected(empty.error());
  if (!*empty) return failure(Fault::kOutputNotEmpty, "{}", folder);
  return {};
}

std::string views_csv(const RunRecord& record) {
  const std::vector<MappingViewRecord> none;
  const auto& views = record.mapping ? record.mapping->views : none;
  const int joints = views.empty() ? 6 : views.front().joints_rad.size();
  std::string csv = "view,phase,time_s";
  for (int i = 1; i <= joints; ++i) csv += fmt::format(",q{}_rad", i);
  csv += ",gain_expected,gain_seen,unknown,free,occupied\n";
  for (std::size_t i = 0; i < views.size(); ++i) {
    const MappingViewRecord& view = views[i];
    csv += fmt::format("{},{},{}", i + 1, view.phase, view.time_s);
    for (int j = 0; j < joints; ++j) csv += fmt::format(",{}", view.joints_rad[j]);
    csv += fmt::format(",{},{},{},{},{}\n", view.gain_expected, view.gain_seen, view.unknown, view.free, view.occupied);
  }
  return csv;
}

Status write_run_files(const std::string& folder, const RunRecord& record, const MapFiles& map) {
  if (Status status = make_directories(folder); !status) return status;
  std::vector<NamedFile> files = files_of_calibration(record);
  for (NamedFile& file : files_of_map(map)) files.push_back(std::move(file));
  files.push_back({"views.csv", views_csv(record)});
  files.push_back({"report.html", report_html(record)});
  files.push_back({"result.json", result_json(record)});
  return write_files(folder, files);
}

}  // namespace firstlook
