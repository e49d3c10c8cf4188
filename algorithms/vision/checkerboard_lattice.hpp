/// Finds a checkerboard among saddle points, in time that is bounded by their number.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "algorithms/vision/saddle_points.hpp"
#include "algorithms/vision/target.hpp"
#include "platform/core/image_view.hpp"

namespace firstlook {

/// Grows lattices from the saddle points of `image` until one is exactly the board: all its corners, row by row, x
/// cross y away from the viewer; empty when none is. Up to a quarter of the corners may be missing among the saddle
/// points (noise, blur, glare) when the image has a corner where the others put it; hidden corners are not made up. The
/// order may still be off by half a turn.
[[nodiscard]] std::vector<Eigen::Vector2d> find_checkerboard_lattice(GrayImage image, const SaddlePoints& saddles,
                                                                     const BoardSpec& board);

}  // namespace firstlook
