/// An arm as data: a chain of rows, joint limits, and capsules that contain each link.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "platform/core/fixed_vector.hpp"
#include "platform/core/joint_vector.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

/// From one joint to the next: Rz(q + theta offset) Tz(d) Tx(a) Rx(alpha), the standard Denavit-Hartenberg row, then
/// Ry(beta) Rz(gamma), which are 0 in such a table. With them a row is any rigid motion, so any chain of rotary joints
/// has rows, and those of axes that are almost parallel stay short.
struct DhRow {
  double theta_offset_rad = 0;
  double d_m = 0;
  double a_m = 0;
  double alpha_rad = 0;
  double beta_rad = 0;
  double gamma_rad = 0;
  [[nodiscard]] bool is_standard() const { return beta_rad == 0 && gamma_rad == 0; }
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

/// Two capsules of a body, the one on the link nearer to the base first.
struct CapsulePair {
  std::uint8_t near = 0;
  std::uint8_t far = 0;
};
inline constexpr std::size_t kArmPairsMax = 80;  ///< leaves room among self pairs for what an arm carries

/// A word of up to 31 characters that is its own memory.
class ArmName {
 public:
  ArmName() = default;
  ArmName(std::string_view word) { *this = word; }  // NOLINT: a word is a name
  /// What does not fit is cut.
  ArmName& operator=(std::string_view word) {
    text_ = {};
    word.copy(text_.data(), text_.size() - 1);
    return *this;
  }
  [[nodiscard]] std::string_view view() const { return text_.data(); }
  operator std::string_view() const { return view(); }  // NOLINT
  [[nodiscard]] bool operator==(const ArmName&) const = default;
  [[nodiscard]] friend bool operator==(const ArmName& name, std::string_view word) { return name.view() == word; }

 private:
  std::array<char, 32> text_{};
};

/// A serial arm of 2 to 7 rotary joints. Axis 1 is the z axis of Base, or points against it.
struct ArmModel {
  ArmName name;
  int joints = 0;
  Pose base_T_first = Pose::Identity();  ///< frame 0: its z is axis 1. The identity for all that are built in
  std::array<DhRow, kJointsMax> dh{};
  std::array<double, kJointsMax> lower_rad{};
  std::array<double, kJointsMax> upper_rad{};
  std::array<double, kJointsMax> speed_max_rad_s{};
  double acceleration_max_rad_s2 = 0;
  Capsules body;  ///< the arm alone: no camera, no gripper

  // Of every arm but the URs (complete_arm in joint_chain.hpp):
  JointVector start_rad;   ///< where a job starts and parks; empty for a UR: default_start
  bool own_pairs = false;  ///< `pairs` says which parts can meet; else the rule of the UR family
  FixedVector<CapsulePair, kArmPairsMax> pairs{};  ///< indices into `body`
};

/// Frames of all links for one configuration: `base_T_link[0]` is the arm's `base_T_first`, `base_T_link[joints]` the
/// flange.
struct LinkFrames {
  std::array<Pose, kJointsMax + 1> base_T_link{};
  int joints = 0;
  [[nodiscard]] Transform<Base, Flange> flange() const {
    return Transform<Base, Flange>(base_T_link[static_cast<std::size_t>(joints)]);
  }
};

/// What is mild for arms whose makers publish no limit: 120 degrees/s^2.
inline constexpr double kUsualAcceleration_rad_s2 = 120 * 3.14159265358979323846 / 180;

/// "ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e", and of test cells "two_joint" and "pr2_like" (other_arms.hpp); empty
/// for any other name.
[[nodiscard]] std::optional<ArmModel> find_arm_model(std::string_view name);

/// How much larger the radii of `ArmModel::body` are than those of `true_body`.
inline constexpr double kBodyPadding_m = 0.010;

/// The slimmer geometry that the simulated cell takes for the real arm: every capsule lies inside `arm.body` whatever
/// the joints are (proved by sampling in tests/unit/kinematics). Grading uses it; planning never does. Of an arm from a
/// file: its capsules as the file gives them, without the padding.
[[nodiscard]] Capsules true_body(const ArmModel& arm);

/// Where a job starts and parks by default: the flange above the base, its z axis (where a camera looks) outwards and
/// 14 degrees or more down, its y axis down, joint 1 at 0. Found by search: stands in the default safe zone with the
/// 0.20 m envelope, with the most room to turn joint 1 by any angle. Of other arms: `start_rad`.
[[nodiscard]] JointVector default_start(const ArmModel& arm);

/// Forward kinematics, about 0.2 us for six joints.
[[nodiscard]] LinkFrames forward(const ArmModel& arm, const JointVector& q_rad);

/// The capsules of `body` moved to where `frames` has their links, in base coordinates.
[[nodiscard]] Capsules place(const Capsules& body, const LinkFrames& frames);

}  // namespace firstlook
