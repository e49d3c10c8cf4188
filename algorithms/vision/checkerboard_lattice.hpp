/// Finds a checkerboard among saddle points, in time that is bounded by their number.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "algorithms/vision/saddle_points.hpp"
#include "algorithms/vision/target.hpp"
#include "platform/core/image_view.hpp"

namespace firstlook {

struct LatticeSearch {
  std::vector<Eigen::Vector2d> corners_px;  ///< all corners, row by row, x cross y away from the viewer; else empty
  int largest = 0;                          ///< points of the largest lattice that was met
};

/// Grows lattices from the saddle points of `image` until one is exactly the board. Up to a quarter of the corners may
/// be missing among the saddle points (noise, blur, glare) when the image has a corner where the others put it; hidden
/// corners are not made up. The order may still be off by half a turn.
[[nodiscard]] LatticeSearch find_checkerboard_lattice(GrayImage image, const SaddlePoints& saddles,
                                                      const BoardSpec& board);

}  // namespace firstlook
