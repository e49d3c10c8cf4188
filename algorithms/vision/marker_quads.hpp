/// Dark squares on white: the outlines that may be markers, with their corners to a few hundredths of a pixel.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Corners of a dark quadrangle, clockwise in the image.
using Quad = std::array<Eigen::Vector2d, 4>;

/// All convex dark quadrangles with sides of at least `side_min_px`, rough (about a pixel), none twice. Local
/// thresholds at three scales, outlines, polygons. About 5 ms for 640x480; images wider than 1300 px are searched at
/// half size.
/// @return kOutOfMemory
[[nodiscard]] Result<std::vector<Quad>> find_dark_quads(GrayImage image, double side_min_px = 10);

/// How well a quadrangle must be known: well enough that its cells can be read (0.06 px off from a start within a
/// pixel, in half the time), or as well as the image tells.
enum class QuadFit : std::uint8_t { kToRead, kToMeasure };

/// Moves each side onto the edge between dark and white (subpixel edge points, a line through them, or a parabola where
/// lens distortion bends it) and the corners to where the sides meet. `cell_px` is how far from it no other edge from
/// dark to white (seen from inside) lies: the width of a marker's border. False when a side has no edge.
[[nodiscard]] bool refine_quad(GrayImage image, double cell_px, QuadFit fit, Quad& quad);

}  // namespace firstlook
