/// From a chain of joints as robot description files have it to the rows of an ArmModel.
#pragma once

#include <vector>

#include "algorithms/kinematics/arm_model.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// A rotary joint: the link before it, moved by `before_T_joint`, then turned by q about `axis`.
struct ChainJoint {
  Pose before_T_joint = Pose::Identity();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< in the joint's frame; any length but 0
  double lower_rad = 0;
  double upper_rad = 0;
  double speed_max_rad_s = 0;
};

/// An arm from its root link to its tip. Frame 0 is the root's, frame i what joint i turns.
struct JointChain {
  std::vector<ChainJoint> joints;      ///< 2 to kJointsMax
  Pose last_T_tip = Pose::Identity();  ///< the flange in the frame of the last joint
  std::vector<Capsule> body;           ///< true sizes, without padding; `link` and coordinates as the frames above
};

/// An arm, and where its Base sits in the root link.
struct ChainedArm {
  ArmModel arm;
  Pose root_T_base = Pose::Identity();
};

/// The same arm as rows, to rounding: equal flange poses for equal joints. Base is the root's frame, moved (and turned
/// where axis 1 is not parallel to its z) until axis 1 is its z axis; each link frame sits where its joint's axis comes
/// nearest to the frame before it, which keeps proven bounds of reach short even for axes that are almost parallel
/// (Hayati and Mirmirani 1985 on why plain Denavit-Hartenberg rows do not). The body is padded; start and pairs come
/// from complete_arm, which the caller runs. Programmer error: fewer than 2 or more than kJointsMax joints, an axis 0.
[[nodiscard]] ChainedArm arm_from_chain(const JointChain& chain, std::string_view name);

/// Why numbers of an arm cannot be right: not finite, limits that are no range or look like degrees, lengths that look
/// like millimetres, no speed, no body on a link that moves. kConfigBadValue with the joint's or link's number (from 1,
/// as `names` has them where it is not empty).
/// @param bare  links that are known to have no body of their own, bit i for link i
[[nodiscard]] Status check_arm(const ArmModel& arm, std::span<const std::string> names, unsigned bare);

/// Sets what every arm but the URs gets by search: which pairs of its capsules can meet, and, where `start_rad` is
/// empty, where a job starts. Error kConfigBadValue: too many pairs for the fixed list, or no posture in which the arm
/// does not touch itself.
[[nodiscard]] Status complete_arm(ArmModel& arm);

}  // namespace firstlook
