/// Do intrinsics that were taken as exact fit the views that were solved with them?
#pragma once

#include <span>
#include <string>

#include "algorithms/calibration/hand_eye_refinement.hpp"

namespace firstlook {

/// A hand-eye transform that was solved with intrinsics taken as exact.
struct SolvedHandEye {
  Transform<Flange, Camera> flange_T_camera;
  Matrix6d covariance = Matrix6d::Zero();  ///< see pose_difference
};

/// Estimates the intrinsics together with everything else from the same views. Says how they differ from those given,
/// and where the camera would sit instead, when both differ by more than one in a thousand right sets would: the
/// intrinsics by their covariance (Wald 1943), the hand-eye transform by the one that was stated for it. Empty
/// otherwise, with fewer than 8 places of the arm, and when the views cannot tell. About 150 ms for 25 views.
[[nodiscard]] std::string intrinsics_misfit(const CameraIntrinsics& given, const Targets& targets,
                                            std::span<const CalibrationView> views, const RefinementOptions& options,
                                            const SolvedHandEye& solved);

}  // namespace firstlook
