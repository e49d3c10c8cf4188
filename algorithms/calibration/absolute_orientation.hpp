/// The rigid motion that takes points onto other points.
#pragma once

#include <Eigen/Core>
#include <span>

#include "platform/core/transform.hpp"

namespace firstlook {

/// Pose of frame B in A by the coordinates of the same points in both: least squares in closed form, the rotation as
/// the eigenvector of Horn's 4x4 matrix to its largest eigenvalue (Horn 1987, Closed-form solution of absolute
/// orientation using unit quaternions). Three points or more that are not on a line; points on a line, or fewer, give
/// one of the many answers.
[[nodiscard]] Pose absolute_orientation(std::span<const Eigen::Vector3d> in_a, std::span<const Eigen::Vector3d> in_b);

/// How many times farther apart the points are in A than in B, by Horn's symmetric formula (his section 2.D): the root
/// of the ratio of the sums of squared distances from the mean. 1 when those in B are all the same.
[[nodiscard]] double scale_between(std::span<const Eigen::Vector3d> in_a, std::span<const Eigen::Vector3d> in_b);

}  // namespace firstlook
