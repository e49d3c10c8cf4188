/// `firstlook board`: a printable target at true size.
#pragma once

#include <string>

#include "algorithms/vision/target_names.hpp"

namespace firstlook {

struct BoardCommandOptions {
  TargetWords words;
  std::string page;  ///< empty: the smallest that fits
  std::string out = "board.pdf";
};

/// Writes the file and says on stderr what was made, and what board.yaml has to say about it on stdout.
/// @return the exit code: 0, 2 for a page that nobody knows, 3 for a target that cannot be made or written
int run_board_command(const BoardCommandOptions& options);

}  // namespace firstlook
