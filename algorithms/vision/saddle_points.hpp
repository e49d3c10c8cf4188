/// A cheap count of points that look like the corners of a checkerboard.
#pragma once

#include <vector>

#include "platform/core/image_view.hpp"

namespace firstlook {

struct SaddlePoint {
  float u = 0, v = 0;  ///< pixels
  /// Second derivatives: the dark squares lie along the direction of the most negative curvature, edges along the two
  /// directions without curvature.
  float xx = 0, yy = 0, xy = 0;
};

/// What a picture holds of them.
struct SaddlePoints {
  int count = 0;
  /// Pixels between the 2nd and 98th percentile of their columns and rows: where a board stands if it stands alone.
  int left = 0, top = 0, right = 0, bottom = 0;
  std::vector<SaddlePoint> points;  ///< row by row
};

/// Local saddle points of the smoothed grey values with black and white alternating four times around them. Every inner
/// corner of a board is one; plain walls, edges and most clutter have few. Looks at full and at half size and returns
/// the more numerous. About 1 ms for 640x480.
[[nodiscard]] SaddlePoints find_saddle_points(GrayImage image);

/// The same at one size: the picture's own, or half of it, which blur and noise harm less; pixels of the full picture.
[[nodiscard]] SaddlePoints find_saddle_points_full(GrayImage image);
[[nodiscard]] SaddlePoints find_saddle_points_halved(GrayImage image);

/// How many a picture must have to be searched for a board: a few may be lost in blur or glare.
[[nodiscard]] constexpr int saddle_points_min(int board_corners) { return board_corners / 2; }

}  // namespace firstlook
