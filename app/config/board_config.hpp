/// The configured board as vision knows it.
#pragma once

#include "algorithms/vision/target_names.hpp"
#include "app/config/config.hpp"

namespace firstlook {

/// @return kConfigBadValue with what is wrong
[[nodiscard]] Result<BoardSpec> board_of(const Config::Board& board);

/// The keys that stand for a board.
[[nodiscard]] Config::Board board_config(const BoardSpec& board);

}  // namespace firstlook
