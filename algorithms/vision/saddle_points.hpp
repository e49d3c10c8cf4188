/// Points that look like the inner corners of a checkerboard.
#pragma once

#include <limits>
#include <vector>

#include "platform/core/image_view.hpp"

namespace firstlook {

struct SaddlePoint {
  float u = 0, v = 0;  ///< pixels
  /// Second derivatives: the dark squares lie along the direction of the most negative curvature, edges along the two
  /// directions without curvature.
  float xx = 0, yy = 0, xy = 0;
};

using SaddlePoints = std::vector<SaddlePoint>;

/// Local saddle points of the smoothed grey values with black and white alternating four times around them, row by row.
/// Every inner corner of a board is one; plain walls, edges and most clutter have few. A picture with more than
/// `count_max` is not looked at any further: the answer is `count_max` + 1 of them. 0.4 ms for 640x480.
[[nodiscard]] SaddlePoints find_saddle_points(GrayImage image,
                                              std::size_t count_max = std::numeric_limits<std::size_t>::max());

/// The same in half the size, which blur and noise harm less; pixels of the full picture.
[[nodiscard]] SaddlePoints find_saddle_points_halved(GrayImage image, std::size_t count_max);

/// How many a picture must have to be searched for a board: a few may be lost in blur or glare.
[[nodiscard]] constexpr std::size_t saddle_points_min(int board_corners) {
  return static_cast<std::size_t>(board_corners / 2);
}

}  // namespace firstlook
