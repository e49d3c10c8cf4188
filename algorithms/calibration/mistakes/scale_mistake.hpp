/// Distances of arm and board in different units, or a board printed in another size.
#pragma once

#include <optional>
#include <span>

#include "algorithms/calibration/mistakes/mistake_trial.hpp"

namespace firstlook::mistakes {

/// By what the board's distances must be multiplied to agree with the arm's.
struct ScaleEstimate {
  double scale = 1;
  double sigma = 0;
};

/// Linear least squares over t_X, t_Z and the scale s in p_i + R_i t_X + s R_i R_X t_i = t_Z with the rotation R_X
/// known, views that contradict weighted down. Empty with fewer than five views or when the motion leaves the scale
/// open.
[[nodiscard]] std::optional<ScaleEstimate> estimate_scale(std::span<const PosePair> pairs,
                                                          const Eigen::Matrix3d& flange_R_camera);

/// The set with its scale put right; empty when the scale does not differ from 1 by 0.4 % and ten of its sigmas.
/// `square_size_m` names the size that fits; 0 when there is no board.
[[nodiscard]] std::optional<Trial> scale_trial(std::span<const PosePair> pairs,
                                               const Transform<Flange, Camera>& flange_T_camera, double square_size_m);

}  // namespace firstlook::mistakes
