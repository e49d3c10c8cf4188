#include "app/config/board_config.hpp"

namespace firstlook {

Result<BoardSpec> board_of(const Config::Board& board) {
  return target_from_words({board.type, board.inner_columns, board.inner_rows, board.square_size_m, board.mark_size_m,
                            board.dictionary, board.first_id, false});
}

Config::Board board_config(const BoardSpec& board) {
  const TargetWords words = words_of(board);
  return {words.type, words.columns, words.rows, words.spacing_m, words.mark_size_m, words.dictionary, words.first_id};
}

}  // namespace firstlook
