/// The file of a UR robot's factory correction as ROS's calibration_correction writes it, made from a controller's rows
/// by the writer's description; independent of what reads it.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook::test {

inline Pose turn_z(double angle) { return Pose(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())); }
inline Pose turn_x(double angle) { return Pose(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX())); }
inline Pose shift(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

/// What the driver's calibration_correction makes of a controller's rows, by its description: each row in two halves,
/// the frames of joints 2 and 3 moved along their axes until their d is 0, then a frame for each joint.
class UrCorrection {
 public:
  explicit UrCorrection(std::span<const DhRow> rows) {
    for (const DhRow& row : rows) {
      halves_.push_back(turn_z(row.theta_offset_rad) * shift(0, 0, row.d_m));
      halves_.push_back(shift(row.a_m, 0, 0) * turn_x(row.alpha_rad));
    }
    for (const std::size_t joint : {1, 2}) move_along_axis(joint, rows[joint]);
  }
  [[nodiscard]] std::string yaml(const std::string& hash) const {
    constexpr const char* kNames[] = {"shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"};
    std::string text = "kinematics:\n";
    for (std::size_t i = 0; i < 6; ++i) {
      const Pose frame = i == 0 ? halves_[0] : halves_[2 * i - 1] * halves_[2 * i];
      const Eigen::Vector3d t = frame.translation(), turn = frame.linear().eulerAngles(0, 1, 2);
      text += fmt::format("  {}:\n    x: {}\n    y: {}\n    z: {}\n    roll: {}\n    pitch: {}\n    yaw: {}\n",
                          kNames[i], t.x(), t.y(), t.z(), turn[0], turn[1], turn[2]);
    }
    return hash.empty() ? text : text + "  hash: " + hash + "\n";
  }

 private:
  void move_along_axis(std::size_t joint, const DhRow& row) {
    if (row.d_m == 0) return;
    const Pose next = halves_[2 * joint] * halves_[2 * joint + 1];
    const Eigen::Vector3d axis = next.linear().col(2), at = next.translation();
    const double along = -at.z() / axis.z();  // where the next axis crosses the plane of this joint's frame
    const Eigen::Vector3d crossing = at + along * axis;
    const double theta = std::atan(crossing.y() / crossing.x());
    halves_[2 * joint] = turn_z(theta);
    halves_[2 * joint + 1] =
        shift(-crossing.norm(), 0, 0) * turn_z(row.theta_offset_rad - theta) * turn_x(row.alpha_rad);
    halves_[2 * joint + 2] = shift(0, 0, -along) * halves_[2 * joint + 2];
  }
  std::vector<Pose> halves_;
};

}  // namespace firstlook::test
