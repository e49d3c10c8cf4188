/// Which link carries the camera: only joints before it move what the camera sees.
#pragma once

#include <span>

#include "algorithms/vision/board_pose.hpp"

namespace firstlook {

struct ViewChange {
  double shift_rms_px = 0;  ///< of the corners, length of the shift
  double rotation_rad = 0;  ///< of the board in the camera
  double translation_m = 0;
  bool changed = false;
};

/// Compares what the camera saw before and after one joint moved by several degrees. `changed` means beyond noise: more
/// than 1 px and eight times `corner_sigma_px`; then the camera hangs beyond that joint (and the board does not).
[[nodiscard]] ViewChange compare_views(const CameraIntrinsics& camera, const BoardSpec& board, const BoardPose& before,
                                       const BoardPose& after, double corner_sigma_px = 0.2);

}  // namespace firstlook
