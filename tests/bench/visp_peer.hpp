/// ViSP's hand-eye calibration. Plain C++17: its headers are not C++20.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

namespace firstlook::bench {

[[nodiscard]] bool visp_installed();

/// flange_T_camera by vpHandEyeCalibration::calibrate; empty when it fails or is not installed.
[[nodiscard]] std::optional<Eigen::Isometry3d> visp_hand_eye(const std::vector<Eigen::Isometry3d>& base_T_flange,
                                                             const std::vector<Eigen::Isometry3d>& camera_T_board);

}  // namespace firstlook::bench
