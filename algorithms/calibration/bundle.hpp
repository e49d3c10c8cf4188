/// The non-linear part of the refinement: reprojection errors of all views and priors on the arm's deviations and the
/// camera's intrinsics.
#pragma once

#include <span>
#include <vector>

#include "algorithms/calibration/hand_eye_refinement.hpp"
#include "algorithms/calibration/reprojection_terms.hpp"

namespace firstlook {

/// One view as the bundle sees it.
struct BundleView {
  Pose base_T_flange_said = Pose::Identity();
  SeenPoints points;
  std::span<const double> weights;  ///< one for each point, 0 to 1
  std::size_t board = 0;            ///< number in BundleState::base_T_board
  std::size_t station = 0;          ///< number in BundleState::deviations
};

/// What is solved for.
struct BundleState {
  CameraIntrinsics camera;  ///< stays as it is unless intrinsics are solved for
  Pose flange_T_camera = Pose::Identity();
  std::vector<Pose> base_T_board;
  std::vector<Vector6d> deviations;  ///< true flange against said, one for each station
};

struct BundleNoise {
  double corner_sigma_px = 0;
  ArmSigma arm_sigma;
};

/// Minimises the whitened squares from `state` on, at most `iterations_max` steps of Levenberg and Marquardt. Single
/// thread, deterministic.
/// @return kSolveFailed when a corner has no image at the start, or for numbers that are not finite
/// @param boards  by BundleView::board
/// @param intrinsics  what of the camera is solved for, and what is believed of it
[[nodiscard]] Status solve_bundle(std::span<const BoardSpec> boards, std::span<const BundleView> views,
                                  const BundleNoise& noise, const IntrinsicsBelief& intrinsics, int iterations_max,
                                  BundleState& state);

/// Normal equations of each view at `state`, weights in 1 / px^2.
struct LinearizedBundle {
  std::vector<ViewNormal> views;
  std::vector<IntrinsicsNormal> intrinsics;  ///< one for each view where intrinsics are solved for, else empty
  std::vector<double> squared_px;            ///< weighted sum of squared residuals of each view
  double weighted_coordinates = 0;           ///< two for each corner of weight 1
};
[[nodiscard]] Result<LinearizedBundle> linearize_bundle(std::span<const BoardSpec> boards,
                                                        std::span<const BundleView> views, double corner_sigma_px,
                                                        bool with_intrinsics, const BundleState& state);

}  // namespace firstlook
