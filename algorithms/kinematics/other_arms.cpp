#include "algorithms/kinematics/other_arms.hpp"

#include <numbers>

#include "algorithms/kinematics/joint_chain.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;

Pose at(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

/// A flange whose z looks along the last link's x, its y down.
Pose looking_along_x(double x) {
  Pose pose = at(x, 0, 0);
  pose.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return pose;
}

ArmModel completed(const JointChain& chain, std::string_view name, const JointVector& start_rad) {
  ArmModel arm = arm_from_chain(chain, name).arm;
  arm.start_rad = start_rad;
  ENSURE(4061, complete_arm(arm).has_value());
  return arm;
}

/// The column is ours; the thesis gives the link, and where the camera sits on it.
ArmModel two_joint() {
  constexpr double kAxis_m = 1.35;  // of tilt above the mounting plate
  constexpr double kLink_m = 1.1;
  JointChain chain;
  chain.joints = {{at(0, 0, 0.2), Eigen::Vector3d::UnitZ(), -170 * kDegree_rad, 170 * kDegree_rad, 1.5},
                  {at(0, 0, kAxis_m - 0.2), -Eigen::Vector3d::UnitY(), -45 * kDegree_rad, 45 * kDegree_rad, 1.5}};
  chain.last_T_tip = looking_along_x(kLink_m);
  chain.body = {{{0, 0, 0.06}, {0, 0, 0.2}, 0.06, 0},
                {{0, 0, 0.05}, {0, 0, kAxis_m - 0.2}, 0.05, 1},
                {{0, 0, 0}, {kLink_m - 0.03, 0, 0}, 0.03, 2}};
  return completed(chain, "two_joint", {0, 0});
}

ArmModel pr2_like() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  JointChain chain;
  chain.joints = {{at(0, 0, 0), z, -2.28, 0.71, 1.9}, {at(0.1, 0, 0), y, -0.52, 1.39, 1.9},
                  {at(0, 0, 0), x, -3.9, 0.8, 1.9},   {at(0.4, 0, 0), y, -2.32, 0, 2.6},
                  {at(0, 0, 0), x, -6.28, 6.28, 2.6}, {at(0.321, 0, 0), y, -2.18, 0, 2.6},
                  {at(0, 0, 0), x, -6.28, 6.28, 2.6}};
  chain.last_T_tip = looking_along_x(0.12);
  chain.body = {{{0, 0, -0.40}, {0, 0, -0.05}, 0.09, 0},               // what carries the shoulder
                {{-0.14, 0.22, -0.36}, {-0.14, 0.22, 0.22}, 0.13, 0},  // torso
                {{-0.08, 0.22, 0.40}, {-0.08, 0.22, 0.44}, 0.11, 0},   // head
                {{0, 0.42, 0}, {0.33, 0.47, -0.18}, 0.07, 0},          // the other arm, standing still
                {{0.33, 0.47, -0.18}, {0.52, 0.36, -0.02}, 0.06, 0},
                {{0, 0, 0}, {0.10, 0, 0}, 0.09, 1},
                {{0, 0, 0}, {0.08, 0, 0}, 0.085, 2},
                {{0.10, 0, 0}, {0.36, 0, 0}, 0.07, 3},
                {{0, 0, 0}, {0, 0, 0}, 0.065, 4},
                {{0.04, 0, 0}, {0.28, 0, 0}, 0.055, 5},
                {{0, 0, 0}, {0, 0, 0}, 0.05, 6},
                {{0.02, 0, 0}, {0.08, 0, 0}, 0.04, 7}};
  return completed(chain, "pr2_like", {-0.6, -0.42, -0.25, -1.53, -1.88, -1.78, -2.67});
}

}  // namespace

std::optional<ArmModel> find_other_arm(std::string_view name) {
  if (name == "two_joint") return two_joint();
  if (name == "pr2_like") return pr2_like();
  return std::nullopt;
}

}  // namespace firstlook
