/// The files of one calibration, the same from a run and from recorded data.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/calibration/verdict.hpp"
#include "app/dataset/hand_eye_file.hpp"
#include "app/report/ros_files.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// What hand_eye.yaml says of a result; intrinsics and camera_T_depth are left unset.
/// @param arm_model  a name of find_arm_model, or kUnknownArm
[[nodiscard]] StoredCalibration stored_calibration(const HandEyeResult& result, std::string_view solver,
                                                   std::string_view arm_model);

/// hand_eye.yaml and, when accepted, the files of ros/: a rejected calibration stays readable, but nothing that a robot
/// would load is made of it.
[[nodiscard]] std::vector<NamedFile> calibration_files(const StoredCalibration& calibration);

/// Writes each file whole or not at all, in their order, with the folders that their names need.
/// @return kDiskWrite with the file's name
[[nodiscard]] Status write_named_files(const std::string& folder, std::span<const NamedFile> files);

}  // namespace firstlook
