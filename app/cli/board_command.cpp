#include "app/cli/board_command.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "app/dataset/calibration_dataset.hpp"
#include "app/report/board_pdf.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

enum ExitCode : int { kMade = 0, kUsageError = 2, kDataError = 3 };

int fail(const Error& error) {
  fmt::print(stderr, "{}\n", describe(error));
  return kDataError;
}

}  // namespace

int run_board_command(const BoardCommandOptions& options) {
  std::optional<PageSize> page;
  if (!options.page.empty()) {
    page = find_page(options.page);
    if (!page) {
      fmt::print(stderr, "no page '{}': A4, A3, letter, or WIDTHxHEIGHT in mm\n", options.page);
      return kUsageError;
    }
  }
  const auto board = target_from_words(options.words);
  if (!board) return fail(board.error());
  const auto sheet = board_sheet(*board, page);
  if (!sheet) return fail(sheet.error());
  if (const Status written = write_file_atomically(options.out, sheet->pdf); !written) return fail(written.error());
  fmt::print(stderr, "{}: {}, on {} ({:.0f} x {:.0f} mm)\n", options.out, describe(*board), sheet->page.name,
             sheet->page.width_mm, sheet->page.height_mm);
  if (sheet->ambiguous) {
    fmt::print(
        stderr,
        "It looks the same upside down, so the order of its points must be guessed from the arm's motion; a "
        "checkerboard of odd x even inner corners (9x6), an asymmetric circle grid with an odd number of rows, or "
        "any marker board needs no guess.\n");
  }
  fmt::print("{}", board_yaml(*board));
  std::fflush(stdout);
  return kMade;
}

}  // namespace firstlook
