/// Finds the inner corners of a checkerboard in a grey image.
#pragma once

#include "algorithms/vision/target.hpp"
#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

struct DetectionOptions {
  int search_width_max_px = 640;  ///< the board is searched in a picture scaled down to this, refined in the full one
  /// Half window of the corner refinement in corner spacings: reaches no other corner up to 65 degrees of tilt, where a
  /// fixed window of 11 px breaks from 35 degrees on.
  double window_of_spacing = 0.4;
  double local_residual_max = 0.25;  ///< largest distance of a corner from where its neighbours put it, in spacings
};

/// Finds the whole board. Cost at 640x480: see algorithms/vision/README.md; a picture without enough strong corner-like
/// points is turned away before the costly search.
/// @return kBoardNotFound when the board is not seen whole or its corners do not fit a plane; kConfigBadValue for a bad
/// board; kDataMalformed for an image below 32x32 or above 8192x8192 pixels
[[nodiscard]] Result<CornerSet> detect_checkerboard(GrayImage image, const BoardSpec& board,
                                                    const DetectionOptions& options = {});

}  // namespace firstlook
