/// A printable target at true size.
#pragma once

#include <optional>
#include <string>

#include "algorithms/vision/target.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

struct PageSize {
  std::string name;
  double width_mm = 0, height_mm = 0;
};

/// "A4", "A3", "letter" (either case), or "WIDTHxHEIGHT" in mm; empty for anything else or beyond 10 to 5000 mm.
[[nodiscard]] std::optional<PageSize> find_page(std::string_view name);

struct BoardSheet {
  std::string pdf;
  PageSize page;           ///< as laid out: turned when that fits better
  bool ambiguous = false;  ///< looks the same upside down
};

/// One page of vector graphics: the target in the middle, above it a line with all parameters, below it rulers across
/// and along the page to check the print with. The same arguments give the same bytes. Without a page the smallest of
/// A4, letter and A3 that holds it.
/// @return kConfigBadValue for a bad target, or one that does not fit, with the sizes
[[nodiscard]] Result<BoardSheet> board_sheet(const BoardSpec& board, const std::optional<PageSize>& page);

}  // namespace firstlook
