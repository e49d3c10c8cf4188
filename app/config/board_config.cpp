#include "app/config/board_config.hpp"

namespace firstlook {

Result<BoardSpec> board_of(const Config::Board& board) {
  return target_from_words({board.type, board.inner_columns, board.inner_rows, board.square_size_m, board.mark_size_m,
                            board.dictionary, board.first_id, board.legacy == "yes"});
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

}  // namespace firstlook
