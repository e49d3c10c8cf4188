/// The factory correction of a UR robot as ROS users keep it: the file that `calibration_correction` of the package
/// ur_calibration (Universal_Robots_ROS_Driver) writes, and that ur_description takes as `kinematics_params_file`.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/kinematics/factory_kinematics.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

struct UrCalibrationFile {
  FactoryFrames frames;  ///< m, in Base, all joints at 0: for with_factory_frames
  std::string hash;      ///< "calib_...", see ur_calibration_hash; empty: the file has none
};

/// `kinematics: {shoulder: {x, y, z, roll, pitch, yaw}, upper_arm, forearm, wrist_1, wrist_2, wrist_3, hash}`: each
/// joint's frame in the frame of the one before, metres and radians, where that one is at 0. The writer takes rotations
/// apart as Rx(roll) Ry(pitch) Rz(yaw) (Eigen's eulerAngles(0, 1, 2)), and so they are put together here: then the
/// flange is where the controller has it. (A URDF has Rz Ry Rx; corrections are small, and the two differ by their
/// square.)
/// Errors: kDataMissing for a file that cannot be read; kConfigBadValue with the key for what is not there, no number,
/// or has axis 1 beside z of Base.
[[nodiscard]] Result<UrCalibrationFile> read_ur_calibration(const std::string& path);
/// The same from text; `name` stands in front of errors.
[[nodiscard]] Result<UrCalibrationFile> parse_ur_calibration(std::string_view yaml, std::string_view name);

/// The hash that the driver writes into the file, of the rows that a controller tells: theta, d, a and alpha of each
/// joint, printed with six digits one behind the other, through std::hash of GNU's library for 64 bits, "calib_" before
/// it. That of the published UR10e is calib_5119701370761913513.
[[nodiscard]] std::string ur_calibration_hash(std::span<const DhRow> rows);

/// How far the flanges of two arms are apart, the largest over a fixed set of postures.
struct FlangeDifference {
  double m = 0, rad = 0;
};
[[nodiscard]] FlangeDifference flange_difference(const ArmModel& one, const ArmModel& other);

}  // namespace firstlook
