/// Nonlinear least squares over one or two rigid transforms, for equations that are linear in their matrix entries.
#pragma once

#include <array>

#include "algorithms/calibration/solvers/algebra.hpp"

namespace firstlook::solvers {

/// Minimises |T p|^2 with p = (vec R, t) of each pose, then 1, by Levenberg and Marquardt with rotations as steps.
/// `triangle` is that of a RowStack of 12 * poses + 1 columns: an iteration costs the same for any number of equations.
/// @return kSolveFailed when 1000 iterations do not end at a minimum
[[nodiscard]] Result<std::vector<Pose>> least_squares_over_poses(const Eigen::MatrixXd& triangle,
                                                                 std::vector<Pose> start);

}  // namespace firstlook::solvers
