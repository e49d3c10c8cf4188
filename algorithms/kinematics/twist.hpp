/// How fast the links move along a joint-linear segment, and bounds of it that hold over a whole interval.
///
/// Along q(t) = from + t dq a point p of link l moves with p'(t) = sum_j dq_j a_j x (p - o_j), and
/// p''(t) = sum_jk dq_j dq_k a_min(j,k) x (a_max(j,k) x (p - o_max(j,k))), so that
/// |p''| <= sum_jk |dq_j dq_k| rho_max(j,k) with rho_k the largest distance of p from axis k in any configuration.
#pragma once

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

/// Velocity of each link for one unit of the path parameter, in base coordinates: a point p of link l moves with
/// angular[l] x p + linear[l].
struct LinkTwists {
  std::array<Eigen::Vector3d, kJointsMax + 1> angular{};
  std::array<Eigen::Vector3d, kJointsMax + 1> linear{};
  int joints = 0;
  [[nodiscard]] Eigen::Vector3d velocity(int link, const Eigen::Vector3d& point) const {
    const auto l = static_cast<std::size_t>(link);
    return angular[l].cross(point) + linear[l];
  }
};

/// Twists of all links at the configuration of `frames` for joint velocities `dq` (rad for each unit of the parameter).
[[nodiscard]] LinkTwists link_twists(const LinkFrames& frames, const JointVector& dq);

/// rho_k of a capsule: no point of its axis is ever farther than [k] metres from the axis of joint k+1, whatever the
/// joints are; 0 for joints that do not move it.
using LeverArms = std::array<double, kJointsMax>;
[[nodiscard]] LeverArms lever_arms(const ArmModel& arm, const Capsule& capsule);

/// Bound of |p''| (m for each unit squared) for every point within `extra_m` of the axis that `levers` belongs to.
[[nodiscard]] double second_derivative_bound(const LeverArms& levers, int link, const JointVector& dq,
                                             double extra_m = 0);

}  // namespace firstlook
