/// Targets as people write them: the keys of board.yaml, of the configuration, of cells and of `firstlook board`.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "algorithms/vision/target.hpp"

namespace firstlook {

/// A target as text and numbers. `type` is one of target_type_names(); `artoolkit` is a pattern marker in the manner of
/// ARToolKit with a picture of our own, `artoolkitplus` a grid of ARToolKitPlus's BCH markers.
struct TargetWords {
  std::string type = "checkerboard";
  int columns = 9;
  int rows = 6;
  double spacing_m = 0.03;  ///< distance of neighbours: side of a square, circle to circle, marker to marker
  double mark_size_m = 0;   ///< side of a marker or diameter of a circle; 0: the type's usual part of the spacing
  std::string dictionary = "auto";
  int first_id = 0;
  bool legacy = false;
};

[[nodiscard]] std::span<const std::string_view> target_type_names();
[[nodiscard]] std::span<const std::string_view> dictionary_names();  ///< "auto" first

/// The target that the words mean, checked. `marker` and `artoolkit` stand alone: their spacing is their side.
/// @return kConfigBadValue with what is wrong and what would do
[[nodiscard]] Result<BoardSpec> target_from_words(const TargetWords& words);

/// The words for a target; target_from_words gives the same target back.
[[nodiscard]] TargetWords words_of(const BoardSpec& board);

/// One line for people: "charuco, 9x6 inner corners of 30 mm, markers 6x6_250 of 22 mm from 0".
[[nodiscard]] std::string describe(const BoardSpec& board);

}  // namespace firstlook
