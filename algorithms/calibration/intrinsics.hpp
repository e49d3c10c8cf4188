/// Camera intrinsics from views of the board (Zhang 2000), for data that comes without camera_info.yaml.
#pragma once

#include <span>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/vision/target_set.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

struct IntrinsicsEstimate {
  CameraIntrinsics camera;
  double reprojection_rms_px = 0;  ///< for each corner (length of the error)
};

/// Focal lengths, centre, k1, k2, p1, p2 (k3 = 0) from at least four views of different tilt. Uses the corners only.
/// @return kTooFewViews, kSolveFailed
[[nodiscard]] Result<IntrinsicsEstimate> estimate_intrinsics(int width, int height, const Targets& targets,
                                                             std::span<const CalibrationView> views);

}  // namespace firstlook
