/// Joint least squares over the hand-eye transform, the poses of one board or several, a deviation of the arm at each
/// place of it, and the camera's intrinsics when they are asked for.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/calibration/intrinsics_prior.hpp"
#include "algorithms/vision/target_set.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Standard deviation of what the arm says about its flange, for each axis.
struct ArmSigma {
  double translation_m = 0;
  double rotation_rad = 0;
};

struct RefinementOptions {
  double corner_sigma_px = 0;  ///< 0: estimated from the residuals
  ArmSigma arm_sigma;          ///< 0: estimated (each by itself)
  /// Lower bounds of the estimates: a quarter of what 48 corners of 0.1 px tell of one view (20 um), so that a perfect
  /// arm is believed; far above rounding.
  ArmSigma arm_sigma_min{5e-6, 5e-6};
  /// What the arm is known to be good for; 0: nothing is known. Few views tell the arm's share of the errors badly from
  /// the camera's, and the estimate then falls to its lower bound: below this it counts like two views of its own.
  ArmSigma arm_sigma_expected;
  double corner_sigma_min_px = 0.01;
  double corner_loss_scale = 3.0;  ///< Huber: corner errors above this many sigmas count linearly
  double view_gate = 6.0;          ///< views whose misfit is more than this many robust sigmas are left out
  int rounds_max = 8;              ///< of solving and estimating sigmas; 1 with both sigmas given is a short refinement
  int iterations_max = 30;         ///< of Levenberg-Marquardt in each round
  /// What of the camera is solved for, from the given one on; the rest of it is taken as exact.
  EstimatedIntrinsics intrinsics = EstimatedIntrinsics::kNone;
  std::optional<IntrinsicsPrior> intrinsics_prior;
};

/// What became of one view.
struct ViewFit {
  bool used = true;                           ///< false: gated as wrong (pose or corners)
  double reprojection_rms_px = 0;             ///< for each coordinate, with this view's arm deviation
  Vector6d arm_deviation = Vector6d::Zero();  ///< true flange minus said flange as pose_difference: m, rad, base axes
};

/// Where one of the targets is.
struct TargetPose {
  int views = 0;  ///< used ones that show it; 0: it could not be solved
  Transform<Base, Board> base_T_board;
  Matrix6d covariance = Matrix6d::Zero();  ///< see pose_difference
};

/// One target as seen from another.
struct MutualPose {
  Transform<Board, Board> pose;
  Matrix6d covariance = Matrix6d::Zero();  ///< see pose_difference: in the axes of the target seen from
};

struct Refinement {
  CameraIntrinsics camera;                  ///< as given, or as estimated
  std::optional<IntrinsicsFit> intrinsics;  ///< when they were estimated
  Transform<Flange, Camera> flange_T_camera;
  Transform<Base, Board> base_T_board;           ///< of the first target that was solved
  Matrix6d covariance = Matrix6d::Zero();        ///< of flange_T_camera, see pose_difference
  Matrix6d board_covariance = Matrix6d::Zero();  ///< of base_T_board
  double corner_sigma_px = 0;
  ArmSigma arm_sigma;
  double reprojection_rms_px = 0;   ///< over the used views, for each coordinate; 0 when there were no corners
  std::vector<ViewFit> views;       ///< one for each input view
  int views_used = 0;               ///< places of the arm with a used view
  std::vector<TargetPose> targets;  ///< one for each target given
  /// Of flange_T_camera, then base_T_board of each solved target in their order, then the estimated intrinsics.
  Eigen::MatrixXd joint_covariance;
};

/// Pose of target `to` in `from` with its covariance, correlations included; empty unless both were solved.
[[nodiscard]] std::optional<MutualPose> mutual_pose(std::span<const TargetPose> targets,
                                                    const Eigen::MatrixXd& joint_covariance, int from, int to);

/// Refines from a start within some centimetres and tens of degrees. Bundle of the reprojection errors with a Gaussian
/// prior on each view's arm deviation (Strobl and Hirzinger 2006 in idea), sigmas by expectation maximisation. Corners
/// and views that do not fit are weighted down or left out. Single thread, about 70 ms for 25 views of 48 corners.
/// Several targets are solved together, seen in any subsets: each view counts for the hand-eye transform through the
/// other views of its target, views of one station share their deviation. A target's only view tells where it is and
/// nothing of the hand-eye; a target without a usable view is left out of `targets`.
/// With intrinsics estimated (about 150 ms for the same views) every covariance holds what they leave open; views that
/// leave focal lengths or centre open give no result.
/// @return kTooFewViews below 3 views; kDataMalformed for numbers that are not finite or wrong counts;
/// kDegenerateMotion when the normal equations are singular; kIntrinsicsUnknown with what cannot be told; kSolveFailed
[[nodiscard]] Result<Refinement> refine_hand_eye(const CameraIntrinsics& camera, const Targets& targets,
                                                 std::span<const CalibrationView> views,
                                                 const Transform<Flange, Camera>& start,
                                                 const RefinementOptions& options = {});

/// The same from pose pairs of one target alone: what does not fit is all taken for deviation of the arm.
[[nodiscard]] Result<Refinement> refine_from_pairs(std::span<const PosePair> pairs,
                                                   const Transform<Flange, Camera>& start,
                                                   const RefinementOptions& options = {});

}  // namespace firstlook
