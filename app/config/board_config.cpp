#include "app/config/board_config.hpp"

namespace firstlook {

Result<BoardSpec> board_of(const Config::Board& board) {
  return target_from_words({board.type, board.inner_columns, board.inner_rows, board.square_size_m, board.mark_size_m,
                            board.dictionary, board.first_id, board.legacy == "yes"});
}

Result<std::vector<NamedTarget>> targets_of(const Config& config) {
  std::vector<NamedTarget> targets;
  if (config.boards.empty()) {
    const auto board = board_of(config.board);
    if (!board) return failure(Fault::kConfigBadValue, "board: {}", board.error().detail());
    targets.push_back({"", *board});
    return targets;
  }
  if (config.board != Config::Board{}) {
    return failure(Fault::kConfigBadValue, "'board' and 'boards' are both given: keep one of them");
  }
  for (const Config::NamedBoard& named : config.boards) {
    const auto board = board_of(named.board);
    if (!board) return failure(Fault::kConfigBadValue, "boards: {:.40}: {}", named.name, board.error().detail());
    targets.push_back({named.name, *board});
  }
  if (const Status distinct = check_distinct(targets); !distinct) {
    return failure(Fault::kConfigBadValue, "boards: {}", distinct.error().detail());
  }
  return targets;
}

void set_targets(std::span<const NamedTarget> targets, Config& config) {
  if (targets.size() == 1) {
    set_board(targets.front().board, config.boards.empty() ? config.board : config.boards.front().board);
    return;
  }
  const std::vector<Config::NamedBoard> before = config.boards;
  Config::Board usual;
  std::swap(usual.detector, config.board.detector);
  config.boards.clear();
  for (std::size_t k = 0; k < targets.size(); ++k) {
    Config::NamedBoard named{targets[k].name, k < before.size() ? before[k].board : usual};
    set_board(targets[k].board, named.board);
    config.boards.push_back(named);
  }
}

void set_board(const BoardSpec& board, Config::Board& config) {
  const TargetWords words = words_of(board);
  config.type = words.type;
  config.inner_columns = words.columns;
  config.inner_rows = words.rows;
  config.square_size_m = words.spacing_m;
  config.mark_size_m = words.mark_size_m;
  config.dictionary = words.dictionary;
  config.first_id = words.first_id;
  config.legacy = words.legacy ? "yes" : "no";
}

bool names_a_board(const Config::Board& board) {
  Config::Board usual;
  usual.detector = board.detector;
  return board != usual;
}

bool names_boards(const Config& config) { return !config.boards.empty() || names_a_board(config.board); }

std::vector<NamedTarget> configured_boards(const Config& config) {
  return names_boards(config) ? targets_of(config).value() : std::vector<NamedTarget>();
}

}  // namespace firstlook
