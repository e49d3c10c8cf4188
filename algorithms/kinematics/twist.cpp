#include "algorithms/kinematics/twist.hpp"

#include <algorithm>
#include <cmath>

namespace firstlook {

namespace {

/// Whether the next axis is parallel to the row's own.
bool leaves_parallel(const DhRow& row) { return row.alpha_rad == 0 && row.beta_rad == 0; }

}  // namespace

LinkTwists link_twists(const LinkFrames& frames, const JointVector& dq) {
  LinkTwists twists;
  twists.joints = frames.joints;
  twists.angular[0].setZero();
  twists.linear[0].setZero();
  for (int j = 0; j < frames.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    const Pose& before = frames.base_T_link[i];  // joint j+1 turns about its z
    const Eigen::Vector3d rate = before.linear().col(2) * dq[j];
    twists.angular[i + 1] = twists.angular[i] + rate;
    twists.linear[i + 1] = twists.linear[i] - rate.cross(before.translation());
  }
  return twists;
}

LeverArms lever_arms(const ArmModel& arm, const Capsule& capsule) {
  LeverArms levers{};
  if (capsule.link == 0) return levers;
  const auto last = static_cast<std::size_t>(capsule.link - 1);  // joint whose row leads to the capsule's frame
  // The last joint: its axis is fixed in the link, so the distance from it is constant.
  const DhRow& row = arm.dh[last];
  Pose joint_T_link =
      Eigen::Translation3d(row.a_m, 0, row.d_m) * Eigen::AngleAxisd(row.alpha_rad, Eigen::Vector3d::UnitX());
  if (!row.is_standard()) {
    joint_T_link = joint_T_link * Eigen::AngleAxisd(row.beta_rad, Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(row.gamma_rad, Eigen::Vector3d::UnitZ());
  }
  const Eigen::Vector3d a = joint_T_link * capsule.a;
  const Eigen::Vector3d b = joint_T_link * capsule.b;
  levers[last] = std::max(a.head<2>().norm(), b.head<2>().norm());
  // Before it: the sum of the links' lengths; what runs along a parallel axis does not lengthen the lever.
  const double tip = std::max(a.norm(), b.norm());
  for (std::size_t k = 0; k < last; ++k) {
    double reach = std::abs(arm.dh[k].a_m);
    bool parallel = leaves_parallel(arm.dh[k]);
    for (std::size_t m = k + 1; m < last; ++m) {
      reach += parallel ? std::abs(arm.dh[m].a_m) : std::hypot(arm.dh[m].a_m, arm.dh[m].d_m);
      parallel = parallel && leaves_parallel(arm.dh[m]);
    }
    levers[k] = reach + (parallel ? levers[last] : tip);
  }
  return levers;
}

double second_derivative_bound(const LeverArms& levers, int link, const JointVector& dq, double extra_m) {
  double bound = 0;
  double before = 0;  // sum of |dq| of the joints before this one
  for (int k = 0; k < link; ++k) {
    const double rate = std::abs(dq[k]);
    bound += (2 * before + rate) * rate * (levers[static_cast<std::size_t>(k)] + extra_m);
    before += rate;
  }
  return bound;
}

}  // namespace firstlook
