/// Does a calibration from an earlier job still hold? Tested on a few views of the board, before anything relies on it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/calibration/hand_eye_refinement.hpp"
#include "algorithms/vision/target_set.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// What is tested, and the noise that its views are expected to have.
struct HandEyeClaim {
  Transform<Flange, Camera> flange_T_camera;
  Matrix6d covariance = Matrix6d::Zero();  ///< see pose_difference
  double corner_sigma_px = 0.1;            ///< that the views at least have; what they show themselves counts if larger
  ArmSigma arm_sigma{1e-4, 2e-4};
};

struct VerificationLimits {
  int views_min = 3;
  double significance = 0.001;           ///< share of right calibrations that the test turns down
  double power = 0.99;                   ///< with this probability it finds an error of the following sizes
  double detectable_max_m = 0.005;       ///< of the translation, in the direction that the views show worst
  double detectable_max_rad = 0.017453;  ///< 1 degree, about the axis that they show worst
};

/// The smallest errors that a test finds with the power asked for, whatever else is wrong at the same time.
struct DetectableError {
  double translation_m = 0;
  double rotation_rad = 0;
  [[nodiscard]] bool within(const VerificationLimits& limits) const {
    return translation_m <= limits.detectable_max_m && rotation_rad <= limits.detectable_max_rad;
  }
};

/// @param views  of one target; of several as many as leave the same degrees of freedom: one less for each further one
/// @param views_covariance what `views` views alone would tell of flange_T_camera: predicted_covariance of their
/// view_information
/// @param claim_covariance that of the calibration to be tested
[[nodiscard]] DetectableError detectable_error(const Matrix6d& views_covariance, const Matrix6d& claim_covariance,
                                               int views, const VerificationLimits& limits = {});

/// One view of the verification against where all views together put the board, the arm's pose taken as said.
struct VerifiedView {
  double residual_rms_px = 0;  ///< for each coordinate
  double board_shift_m = 0;    ///< of the board's centre
  double board_turn_rad = 0;
};

struct Verification {
  bool holds = false;
  std::vector<std::string> reasons;  ///< why not: figure and limit
  double chi2 = 0;
  int degrees_of_freedom = 0;
  double chi2_limit = 0;
  DetectableError detectable;
  double corner_sigma_px = 0;  ///< as used: from the corners of each view against its own best pose of the board
  double residual_rms_px = 0;  ///< over all views, for each coordinate
  double residual_rms_m = 0;   ///< of the board's centre
  std::vector<VerifiedView> views;
  std::vector<TargetPose> targets;  ///< by all views, one for each target given
};

/// Chi-square test of the hypothesis that each board stands still in base: each view puts it at
/// base_T_flange * flange_T_camera * camera_T_board, and these must agree within the covariance of the calibration
/// (one error, common to all views), the corner noise and the arm's deviation (of each place by itself). The boards'
/// poses are free, so `n` views of `k` targets leave 6 (n - k) degrees of freedom; a target's only view says nothing. A
/// calibration also fails when the views are too much alike to find an error of the sizes in `limits`: agreement of
/// views that could not disagree says nothing. What no views of one board can show: an error of the flange frame
/// itself, or of base (algorithms/calibration/README).
/// @return kTooFewViews below `limits.views_min` places of the arm, or when boards are not found at enough of them;
/// kSolveFailed for numbers that are not finite
[[nodiscard]] Result<Verification> verify_hand_eye(const CameraIntrinsics& camera, const Targets& targets,
                                                   std::span<const CalibrationView> views, const HandEyeClaim& stated,
                                                   const VerificationLimits& limits = {});

}  // namespace firstlook
