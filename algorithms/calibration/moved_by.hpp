/// How an error of a pose moves what is held by it.
#pragma once

#include "algorithms/calibration/calibration_view.hpp"

namespace firstlook {

/// What a pose_difference d becomes at another place: that of a pose held rigidly at `lever_m` (in d's axes) from the
/// one that d is of, in axes that `to_axes` turns d's into. d(R p + t) for a turn of R by d is d x (R p), so the
/// derivative by d is -[R p]x.
[[nodiscard]] inline Matrix6d moved_by(const Eigen::Matrix3d& to_axes, const Eigen::Vector3d& lever_m) {
  Matrix6d j = Matrix6d::Zero();
  j.topLeftCorner<3, 3>() = to_axes;
  j.topRightCorner<3, 3>() = -to_axes * cross_matrix(lever_m);
  j.bottomRightCorner<3, 3>() = to_axes;
  return j;
}

}  // namespace firstlook
