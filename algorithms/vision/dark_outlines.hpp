/// Outlines of the dark areas of an image, for the searches of squares and of discs.
#pragma once

#include <functional>
#include <vector>

#include "platform/core/image_view.hpp"

namespace firstlook {

struct Pixel {
  int x = 0, y = 0;
  bool operator==(const Pixel&) const = default;
};

/// A closed chain of neighbouring pixels.
using Outline = std::vector<Pixel>;

/// The outer outlines of the areas (neighbours by edge or corner) that are
/// darker than the mean of a window of `window_px` around each pixel. `may_be` is asked with the size of an area's
/// bounding box, both pixels included: only outlines that it wants are followed. An outline that is twice as long as
/// the one of its box is no polygon or ellipse that anybody searches: it is left out before its end, so that the time
/// is bounded by the pixels whatever they show.
///
/// The outlines of cv::findContours (Suzuki & Abe 1985) from the same first pixels, without those of the holes, of
/// which a noisy picture has 100,000: areas are told apart by runs (He, Chao, Suzuki 2008: two tables of labels made
/// one), a tenth of the time of following them all.
[[nodiscard]] std::vector<Outline> dark_outlines(GrayImage image, int window_px,
                                                 const std::function<bool(int width, int height)>& may_be);

}  // namespace firstlook
