#include "app/report/run_files.hpp"

#include <fmt/format.h>

#include "app/report/calibration_files.hpp"
#include "app/report/report_html.hpp"
#include "app/report/result_json.hpp"
#include "app/report/ros_files.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

/// This run's calibration; of a stored one the same again, with the verdict of its test.
StoredCalibration stored_form(const RunRecord& record) {
  if (record.verified) {
    StoredCalibration c = record.verified->calibration;
    c.accepted = c.accepted && record.hand_eye->verdict == Verdict::kAccepted;
    return c;
  }
  StoredCalibration c = stored_calibration(*record.hand_eye, record.solver, record.provenance.arm_model);
  if (record.provenance.kinematics != 0) c.kinematics = record.provenance.kinematics;
  c.intrinsics = record.intrinsics;
  if (!record.alignment) return c;
  const DepthCameraRecord& depth = record.alignment->depth_camera;
  c.camera_T_depth = depth.mount.camera_T_depth;
  if (depth.source == ValueSource::kEstimated) {
    c.depth_mount = depth.mount;
    c.stated_camera_T_depth = depth.stated;
  }
  const auto stored = [](const StampRecord& stamps) {
    return stamps.source == ValueSource::kEstimated ? std::optional(StoredOffset{stamps.offset_s, stamps.sigma_s})
                                                    : std::nullopt;
  };
  c.color_offset = stored(record.alignment->color_stamps);
  c.depth_offset = stored(record.alignment->depth_stamps);
  return c;
}

std::vector<NamedFile> files_of_run(const RunRecord& record) {
  std::vector<NamedFile> files;
  if (record.hand_eye) files = calibration_files(stored_form(record));
  if (record.intrinsics.width > 0) files.push_back({"camera_info.yaml", camera_info_yaml(record.intrinsics)});
  return files;
}

std::vector<NamedFile> files_of_map(const MapFiles& map) {
  std::vector<NamedFile> files;
  if (!map.fine_map_bt.empty()) files.push_back({"fine_map.bt", map.fine_map_bt});
  if (!map.collision_map_bt.empty()) files.push_back({"collision_map.bt", map.collision_map_bt});
  if (!map.map_ot.empty()) files.push_back({"map.ot", map.map_ot});
  if (!map.color_map_ot.empty()) files.push_back({"color_map.ot", map.color_map_ot});
  if (!map.map_ply.empty()) files.push_back({"map.ply", map.map_ply});
  if (map.occupied.empty()) return files;
  for (NamedFile& file : ros_scene_files(map.occupied)) files.push_back({"ros/" + file.name, std::move(file.text)});
  return files;
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
  std::vector<NamedFile> files = files_of_run(record);
  for (NamedFile& file : files_of_map(map)) files.push_back(std::move(file));
  files.push_back({"views.csv", views_csv(record)});
  files.push_back({"report.html", report_html(record)});
  files.push_back({"result.json", result_json(record)});
  return write_named_files(folder, files);
}

}  // namespace firstlook
