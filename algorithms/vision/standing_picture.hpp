/// Whether a few frames of the board show a picture that stands still, what its corners are, and what they scatter.
#pragma once

#include <span>

#include "algorithms/vision/target.hpp"

namespace firstlook {

struct StandingPicture {
  CornerSet mean;  ///< see average_corners
  /// Largest motion of the picture as a whole from one frame to the next: RMS over the corners of the affine motion
  /// that fits their displacements best. 0 with one frame.
  double moved_px = 0;
  /// Standard deviation of a corner in one frame, each coordinate, whole motions taken out; 0 with one frame.
  double scatter_px = 0;
  /// False: `moved_px` is more than the scatter explains and more than `still_px`.
  bool still = true;
};

/// Looks at frames of one board that were taken one after the other. The affine motion is tested against what is left
/// of the displacements by an F test with a level of 1 in 10,000; fewer than 8 common corners allow a shift only.
/// `still_px`: a smaller motion does not matter.
/// @return kBoardNotFound as average_corners does
[[nodiscard]] Result<StandingPicture> judge_standing(std::span<const CornerSet> frames, double still_px = 0.02);

}  // namespace firstlook
