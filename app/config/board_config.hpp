/// The configured boards as vision knows them.
#pragma once

#include "algorithms/vision/target_names.hpp"
#include "algorithms/vision/target_set.hpp"
#include "app/config/config.hpp"

namespace firstlook {

/// @return kConfigBadValue with what is wrong
[[nodiscard]] Result<BoardSpec> board_of(const Config::Board& board);

/// All that the job looks for: `boards`, or `board` without a name.
/// @return kConfigBadValue with what is wrong: no board, boards that can be taken for each other, both keys in use
[[nodiscard]] Result<std::vector<NamedTarget>> targets_of(const Config& config);

/// Sets `board` or `boards`; the detector stays.
void set_targets(std::span<const NamedTarget> targets, Config& config);

/// Sets the keys that stand for a board; the detector stays.
void set_board(const BoardSpec& board, Config::Board& config);

/// True for keys that somebody changed: boards of his own, not those that a simulated cell brings along.
[[nodiscard]] bool names_a_board(const Config::Board& board);
[[nodiscard]] bool names_boards(const Config& config);
/// The boards that the configuration names, if it names any; load_config has refused what is no board.
[[nodiscard]] std::vector<NamedTarget> configured_boards(const Config& config);

}  // namespace firstlook
