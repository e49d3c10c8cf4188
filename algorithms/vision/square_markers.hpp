/// Finds the square markers of a target in a grey image and reads their numbers.
#pragma once

#include <vector>

#include "algorithms/vision/marker_quads.hpp"
#include "algorithms/vision/target.hpp"

namespace firstlook {

struct SquareMarker {
  int marker = 0;   ///< which of the target's, 0 to BoardSpec::markers() - 1
  Quad corners_px;  ///< from the marker's own upper left corner, clockwise
  int wrong_cells = 0;
};

/// All markers of the target (ChArUco, marker grid, pattern marker) that the image shows, in ascending order. A marker
/// that is found at two places counts as not found.
/// @return kOutOfMemory
[[nodiscard]] Result<std::vector<SquareMarker>> find_square_markers(GrayImage image, const BoardSpec& board);

/// Points of the target from its markers: corners of the markers of a grid, or the inner corners of a ChArUco board
/// beside them, refined in the image. Markers that contradict the others are left out.
/// @return kBoardNotFound when fewer than a quarter of the points are seen, or they lie on a line; kConfigBadValue,
/// kDataMalformed and kOutOfMemory as detect_checkerboard
[[nodiscard]] Result<CornerSet> detect_marker_target(GrayImage image, const BoardSpec& board);

}  // namespace firstlook
