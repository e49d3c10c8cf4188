/// Which views of the board tell something of their own about the arm.
#pragma once

#include <span>
#include <vector>

#include "platform/core/joint_vector.hpp"

namespace firstlook {

/// What an arm's pose is off by (gears, links, encoders) is a smooth function of its joints: configurations nearer than
/// this share most of it, and a solve that took their deviations for independent would be surer than it may be.
/// Euclidean norm over the joints; 20 degrees.
inline constexpr double kSharedDeviation_rad = 0.35;

/// Indices, in rising order, of configurations at least `apart_rad` from each other. Later ones win: they were chosen
/// for what they add, the first ones to learn where the camera sits.
[[nodiscard]] std::vector<std::size_t> spread_views(std::span<const JointVector> configurations,
                                                    double apart_rad = kSharedDeviation_rad);

/// Euclidean norm of the difference (rad).
[[nodiscard]] double joint_distance_rad(const JointVector& a, const JointVector& b);

}  // namespace firstlook
