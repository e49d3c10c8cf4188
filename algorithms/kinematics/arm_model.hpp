/// An arm as data: Denavit-Hartenberg chain, joint limits, and capsules that contain each link.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "platform/core/fixed_vector.hpp"
#include "platform/core/joint_vector.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

/// One row of standard DH parameters: Rz(theta) Tz(d) Tx(a) Rx(alpha). Metres, radians.
struct DhRow {
  double theta_offset_rad = 0;
  double d_m = 0;
  double a_m = 0;
  double alpha_rad = 0;
};

/// All points within `radius_m` of the segment from `a` to `b`; coordinates in the frame of its link.
struct Capsule {
  Eigen::Vector3d a = Eigen::Vector3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double radius_m = 0;
  int link = 0;  ///< 0 is the fixed base, link i moves with joints 1..i; the flange is the last link
};

inline constexpr std::size_t kCapsulesMax = 24;
using Capsules = FixedVector<Capsule, kCapsulesMax>;

/// A serial arm of 2 to 7 rotary joints.
struct ArmModel {
  std::string_view name;
  int joints = 0;
  std::array<DhRow, kJointsMax> dh{};
  std::array<double, kJointsMax> lower_rad{};
  std::array<double, kJointsMax> upper_rad{};
  std::array<double, kJointsMax> speed_max_rad_s{};
  double acceleration_max_rad_s2 = 0;
  Capsules body;  ///< the arm alone: no camera, no gripper
};

/// Frames of all links for one configuration: `base_T_link[0]` is the identity, `base_T_link[joints]` the flange.
struct LinkFrames {
  std::array<Pose, kJointsMax + 1> base_T_link{};
  int joints = 0;
  [[nodiscard]] Transform<Base, Flange> flange() const {
    return Transform<Base, Flange>(base_T_link[static_cast<std::size_t>(joints)]);
  }
};

/// "ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e"; empty for any other name.
[[nodiscard]] std::optional<ArmModel> find_arm_model(std::string_view name);

/// How much larger the radii of `ArmModel::body` are than those of `true_body`.
inline constexpr double kBodyPadding_m = 0.010;

/// The slimmer geometry that the simulated cell takes for the real arm: every capsule lies inside `arm.body` whatever
/// the joints are (proved by sampling in tests/unit/kinematics). Grading uses it; planning never does.
[[nodiscard]] Capsules true_body(const ArmModel& arm);

/// Where a job starts and parks by default: the flange above the base, its z axis (where a camera looks) outwards and
/// 14 degrees or more down, its y axis down, joint 1 at 0. Found by search: stands in the default safe zone with the
/// 0.20 m envelope, with the most room to turn joint 1 by any angle.
[[nodiscard]] JointVector default_start(const ArmModel& arm);

/// Forward kinematics, about 0.2 us for six joints.
[[nodiscard]] LinkFrames forward(const ArmModel& arm, const JointVector& q_rad);

/// The capsules of `body` moved to where `frames` has their links, in base coordinates.
[[nodiscard]] Capsules place(const Capsules& body, const LinkFrames& frames);

}  // namespace firstlook
