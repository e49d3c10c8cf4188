/// Camera intrinsics from views of the board alone (Zhang 2000): where the joint estimate starts when there is no
/// camera_info.yaml.
#pragma once

#include <span>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/target_set.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

struct IntrinsicsEstimate {
  CameraIntrinsics camera;
  IntrinsicsVector sigma = IntrinsicsVector::Zero();  ///< as the pictures alone tell them; 0 for k3
  double reprojection_rms_px = 0;                     ///< for each corner (length of the error)
  double normals_spread_rad = 0;  ///< of the boards in the camera: how different their tilts are, RMS
};

/// Focal lengths, centre, k1, k2, p1, p2 (k3 = 0) from at least four views of different tilt. Uses the corners only.
/// @return kTooFewViews; kIntrinsicsUnknown with what the views leave open (sigma above 20 %), such as all of it when
/// all of them look at the board straight; kSolveFailed
[[nodiscard]] Result<IntrinsicsEstimate> estimate_intrinsics(int width, int height, const Targets& targets,
                                                             std::span<const CalibrationView> views);

}  // namespace firstlook
