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
  int fixed_half_window_px = 0;  ///< instead, in pixels; 0: by the spacing
  int refinement_iterations = 40;
  double refinement_step_px = 0.001;  ///< a smaller step ends the refinement
  double local_residual_max = 0.25;   ///< largest distance of a corner from where its neighbours put it, in spacings
};

/// Finds the whole board: saddle points of the picture, put into rows and columns, refined. Time is bounded by the
/// number of pixels, board or no board: see algorithms/vision/README.md.
/// @return kBoardNotFound when the board is not seen whole or its corners do not fit a plane; kConfigBadValue for a bad
/// board; kDataMalformed for an image below 32x32 or above 8192x8192 pixels
[[nodiscard]] Result<CornerSet> detect_checkerboard(GrayImage image, const BoardSpec& board,
                                                    const DetectionOptions& options = {});

}  // namespace firstlook
