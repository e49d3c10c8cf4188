/// Boards that look the same upside down: which views took the board the other way round?
#pragma once

#include <span>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/vision/target.hpp"

namespace firstlook {

/// For a board of even x even or odd x odd corners: true for each view whose corners must be reversed so that all views
/// agree with the arm's motion; the first view stays. Tries all turns of random fours of views in closed form and keeps
/// the one under which the views agree best. All false with fewer than four views or when nothing can be told.
[[nodiscard]] std::vector<bool> settle_board_flips(const BoardSpec& board, std::span<const PosePair> pairs);

}  // namespace firstlook
