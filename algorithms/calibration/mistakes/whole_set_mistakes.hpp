/// Mistakes that change every pose of a set alike: inverted, quaternions in another order, rows shifted.
#pragma once

#include <span>
#include <vector>

#include "algorithms/calibration/mistakes/mistake_trial.hpp"

namespace firstlook::mistakes {

/// The set with each of these mistakes undone, the commonest first. `board_poses_given`: the board's poses were read
/// (pairs.csv), not computed from corners, so that they can be wrong in all these ways too. Not among them: both sides
/// inverted, or exchanged with each other. That fits as well as before, with hand-eye and the board's pose in each
/// other's place: A X B = Z gives A^-1 Z B^-1 = X and B Z^-1 A = X^-1.
[[nodiscard]] std::vector<Trial> whole_set_trials(std::span<const PosePair> pairs, bool board_poses_given);

/// The set with poses moved against the images by one or two places, reversed, or sorted as text instead of numbers.
[[nodiscard]] std::vector<Trial> order_trials(std::span<const PosePair> pairs);

}  // namespace firstlook::mistakes
