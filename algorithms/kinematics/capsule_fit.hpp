/// A capsule around points: how the shapes of a robot description become parts of an arm's body.
#pragma once

#include <span>

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

/// A capsule that contains every point, small in volume: the best of several axes (those of the points' spread and of
/// their frame), each with several radii. Not the smallest that exists: within some 10 % for boxes and cylinders.
/// Programmer error: no point.
[[nodiscard]] Capsule fit_capsule(std::span<const Eigen::Vector3d> points, int link);

/// How far the farthest point is outside of the capsule; 0 or less: it holds them all. -infinity without points.
[[nodiscard]] double farthest_outside_m(const Capsule& capsule, std::span<const Eigen::Vector3d> points);

}  // namespace firstlook
