/// The configured board as vision knows it.
#pragma once

#include "algorithms/vision/target_names.hpp"
#include "app/config/config.hpp"

namespace firstlook {

/// @return kConfigBadValue with what is wrong
[[nodiscard]] Result<BoardSpec> board_of(const Config::Board& board);

/// Sets the keys that stand for a board; the detector stays.
void set_board(const BoardSpec& board, Config::Board& config);

/// True for keys that somebody changed: a board of his own, not the one that a simulated cell brings along.
[[nodiscard]] bool names_a_board(const Config::Board& board);

}  // namespace firstlook
