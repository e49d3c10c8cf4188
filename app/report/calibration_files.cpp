#include "app/report/calibration_files.hpp"

#include <algorithm>

#include "algorithms/kinematics/arm_model.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {

StoredCalibration stored_calibration(const HandEyeResult& result, std::string_view solver, std::string_view arm_model) {
  StoredCalibration c;
  c.accepted = result.verdict == Verdict::kAccepted;
  c.arm_model = arm_model;
  if (const auto arm = find_arm_model(arm_model)) c.kinematics = kinematics_checksum(*arm);
  c.flange_T_camera = result.flange_T_camera;
  c.covariance = result.covariance;
  c.corner_sigma_px = result.corner_sigma_px;
  c.arm_sigma = result.arm_sigma;
  c.solver = solver;
  c.views = result.views;
  c.views_given = static_cast<int>(result.fits.size());
  c.reprojection_rms_px = result.reprojection_rms_px;
  c.holdout_rms_px = result.holdout_rms_m > 0 ? result.holdout_rms_px : 0;
  c.usable_distance_m = result.usable_distance_m;
  return c;
}

std::vector<NamedFile> calibration_files(const StoredCalibration& calibration) {
  std::vector<NamedFile> files = {{"hand_eye.yaml", hand_eye_yaml(calibration)}};
  if (!calibration.accepted) return files;
  for (NamedFile& file : ros_calibration_files(calibration.flange_T_camera)) {
    files.push_back({"ros/" + file.name, std::move(file.text)});
  }
  return files;
}

Status write_named_files(const std::string& folder, std::span<const NamedFile> files) {
  const bool ros = std::ranges::any_of(files, [](const NamedFile& f) { return f.name.starts_with("ros/"); });
  if (Status status = make_directories(ros ? folder + "/ros" : folder); !status) return status;
  for (const NamedFile& file : files) {
    if (Status status = write_file_atomically(folder + "/" + file.name, file.text); !status) return status;
  }
  return {};
}

}  // namespace firstlook
