/// Degrees for radians, rotation vectors for roll, pitch and yaw: rotations that went through three wrong numbers.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "algorithms/calibration/mistakes/mistake_trial.hpp"

namespace firstlook::mistakes {

/// What the positions of one side of the pairs say when its rotations are not believed.
struct PositionsFit {
  double median_m = 0;                        ///< distance of the positions from where the other side puts them
  std::vector<Eigen::Matrix3d> rotation_for;  ///< the rotation not believed, up to a common factor on the right
};

/// The flange's rotations (or the board's) are left out: nine unknowns, three equations for each view (Ernst et al.
/// 2012 in form, then Gauss-Newton). Empty with fewer than six views or when the views leave something open.
[[nodiscard]] std::optional<PositionsFit> fit_positions(std::span<const PosePair> pairs, bool without_flange_rotations);

/// The set with the angles of the flange (or of the board) read as they were meant, for each way to misread them that
/// explains seven views of ten or more. Angles in degrees wrap 57 times when they are taken for radians: which turn was
/// meant follows from the positions. About 0.3 s.
[[nodiscard]] std::vector<Trial> angle_trials(std::span<const PosePair> pairs, const PositionsFit& positions,
                                              bool of_flange);

}  // namespace firstlook::mistakes
