/// Mistakes that only corners can tell: their order, mirrored images, intrinsics of another camera.
#pragma once

#include <span>
#include <vector>

#include "algorithms/calibration/mistakes/mistake_trial.hpp"
#include "algorithms/vision/target.hpp"
#include "platform/core/camera_intrinsics.hpp"

namespace firstlook::mistakes {

/// A pose pair of each view whose corners fit a board, and which view that is.
struct ViewPairs {
  std::vector<PosePair> pairs;
  std::vector<std::size_t> views;
};
[[nodiscard]] ViewPairs pairs_of(const CameraIntrinsics& camera, const BoardSpec& board,
                                 std::span<const CalibrationView> views);

/// The views with each mistake undone, as pairs; trials whose corners fit a board in fewer than seven views of ten are
/// left out. The images' size is the camera's.
[[nodiscard]] std::vector<Trial> corner_trials(const CameraIntrinsics& camera, const BoardSpec& board,
                                               std::span<const CalibrationView> views);

}  // namespace firstlook::mistakes
