/// The whole hand-eye calibration: solve, validate, judge.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/calibration/hand_eye_refinement.hpp"
#include "algorithms/calibration/likely_mistake.hpp"
#include "algorithms/calibration/touch_test.hpp"
#include "platform/core/parallel.hpp"

namespace firstlook {

/// What a calibration must meet to be accepted.
struct VerdictLimits {
  int views_min = 6;
  double sigma_translation_max_m = 0.001;  ///< largest of the three axes
  double sigma_rotation_max_rad = 0.002;
  double holdout_rms_max_px = 2.0;     ///< views left out of the solve, arm deviations included
  double holdout_rms_max_m = 0.003;    ///< the board's centre as such views see it, against where the others put it
  double subset_spread_max_m = 0.003;  ///< RMS distance of 100 solves on 70 % of the views from the whole
  double gated_views_max = 0.25;       ///< share of the views that may be wrong
  /// As many of the first, or of the last, may be wrong: more in a row, with all others right, say that something moved
  /// while views were taken, however few they are. After the first nothing moved any more, and the others tell what
  /// holds now; of the last it may be the one that does.
  int gated_first_max = 1;
  int gated_last_max = 1;
  double voxel_size_m = 0.05;  ///< mapping: 3 sigma at mapping_distance_m within half of it
  double mapping_distance_m = 1.5;
  double tolerance_m = 0.01;  ///< of the gripper, for the usable distance (thesis eq. 7-2)
  double usable_distance_min_m = 0.3;
  TouchTestLimits touch;
};

struct HandEyeOptions {
  Solver solver = Solver::kParkMartin;
  RefinementOptions refinement;
  VerdictLimits limits;
  int subset_solves = 100;
  double subset_share = 0.7;
  std::uint64_t seed = 1;  ///< of the random subsets
};

enum class Verdict : std::uint8_t { kAccepted, kRejected };

/// Everything that result.json's hand_eye object says, and what the report shows beside it.
struct HandEyeResult {
  CameraIntrinsics camera;                    ///< that everything holds for: as given, or as estimated
  std::optional<IntrinsicsFit> intrinsics{};  ///< when they were estimated (RefinementOptions::intrinsics)
  Transform<Flange, Camera> flange_T_camera;
  Transform<Flange, Camera> closed_form;      ///< what the chosen solver alone gave: the refinement's start
  std::optional<Matrix3x4d> closed_form_raw;  ///< the same before its rotation was made one, by the linear solvers
  Transform<Base, Board> base_T_board;        ///< of the first target that was solved
  std::vector<TargetPose> targets;            ///< one for each target given
  Eigen::MatrixXd joint_covariance;           ///< of flange_T_camera, all solved targets and intrinsics, see Refinement
  Matrix6d covariance = Matrix6d::Zero();     ///< of flange_T_camera: pose_difference, m and rad, flange axes
  Matrix6d board_covariance = Matrix6d::Zero();
  Eigen::Vector3d sigma_translation_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_rotation_rad = Eigen::Vector3d::Zero();
  double reprojection_rms_px = 0;  ///< 0 when solved from pose pairs
  double holdout_rms_px = 0;       ///< 0 when solved from pose pairs
  double holdout_rms_m = 0;        ///< board centre as predicted by the others against as seen, RMS distance
  double subset_spread_m = 0;      ///< RMS over the solves of the distance of their translation from the whole's
  double subset_spread_rad = 0;
  /// What those solves gave, in the order of the subsets (ViewSubsets) without those that failed; empty until
  /// validated.
  std::vector<Transform<Flange, Camera>> subset_solutions;
  double usable_distance_m = 0;
  double corner_sigma_px = 0;
  ArmSigma arm_sigma;
  AxXbResidual ax_xb_all_pairs;
  AxXbResidual ax_xb_consecutive;
  AxXbResidual board_in_base;  ///< the board's pose in base by each view against their mean
  bool from_pairs = false;
  int views = 0;              ///< places of the arm with a view used in the solve
  std::vector<ViewFit> fits;  ///< one for each view given
  /// One for each view given: its reprojection RMS (px) under a solve that left it out; empty for a view that was not
  /// used. Empty as a whole until validated and when solved from pose pairs.
  std::vector<std::optional<double>> holdout_px;
  Verdict verdict = Verdict::kRejected;
  std::vector<std::string> reasons;  ///< why rejected; empty when accepted
  /// The one view that contradicts the others is the last, and that rejects: more views would tell whether it is wrong
  /// by itself or something has moved.
  bool only_last_contradicts = false;
  /// What people most likely did wrong; also the last of the reasons when rejected. Of an accepted calibration: what is
  /// wrong with the views that were left out. Empty when nothing was found.
  std::optional<LikelyMistake> likely_mistake;
  std::optional<TouchTest> touch_test;  ///< when somebody touched the board (test_hand_eye_by_touch)
};

/// What somebody did with the arm's tip: the board that was touched, and the touches.
struct TouchRecord {
  int target = 0;  ///< which of the targets
  std::vector<Touch> touches;
  std::optional<TipOffset> tip;  ///< empty: to be estimated
};

/// Several targets are solved together as refine_hand_eye says; held out and drawn at random are then whole places of
/// the arm, with all that was seen from them.
/// Closed form, refinement, hold-out, subsets, usable distance, verdict. Deterministic. About 1 s for 25 views of 54
/// corners. A rejected calibration is a value, not an error.
/// @return the errors of solve_pose_pairs and refine_hand_eye
[[nodiscard]] Result<HandEyeResult> calibrate_hand_eye(const CameraIntrinsics& camera, const Targets& targets,
                                                       std::span<const CalibrationView> views,
                                                       const HandEyeOptions& options = {});
[[nodiscard]] Result<HandEyeResult> calibrate_hand_eye_from_pairs(std::span<const PosePair> pairs,
                                                                  const HandEyeOptions& options = {});

/// The two halves of calibrate_hand_eye for a job that solves first and validates later: the first leaves holdout,
/// subsets and usable distance unset and the verdict kRejected, "not validated". Validation takes the same camera as
/// was given to the solve; where that was to be estimated, each of its solves estimates it anew.
[[nodiscard]] Result<HandEyeResult> solve_hand_eye(const CameraIntrinsics& camera, const Targets& targets,
                                                   std::span<const CalibrationView> views,
                                                   const HandEyeOptions& options = {});
void validate_hand_eye(const CameraIntrinsics& camera, const Targets& targets, std::span<const CalibrationView> views,
                       const HandEyeOptions& options, HandEyeResult& result, RunParallel run_parallel = run_serially);

/// The touch test of a validated calibration: fills touch_test and rejects where it does not agree.
/// @param used  the pose pairs that it was solved from (used_pairs), or more of the same target
/// @return the errors of locate_touched_board; kTouchesUnusable when no view shows the touched board
[[nodiscard]] Status test_hand_eye_by_touch(const Targets& targets, const TouchRecord& touched,
                                            std::span<const PosePair> used, const TouchTestLimits& limits,
                                            HandEyeResult& result);

/// The pose pairs that `result` was solved from, settled among the poses that each picture allows.
[[nodiscard]] std::vector<PosePair> used_pairs(const CameraIntrinsics& camera, const Targets& targets,
                                               std::span<const CalibrationView> views, const HandEyeResult& result);
[[nodiscard]] std::vector<PosePair> used_pairs(std::span<const PosePair> pairs, const HandEyeResult& result);

/// Which limits the covariance of a calibration exceeds by itself (sigmas, mapping distance, usable distance), each
/// with its figure; empty when none. Part of the verdict, and all of it that holds for a calibration from elsewhere.
[[nodiscard]] std::vector<std::string> covariance_reasons(const VerdictLimits& limits, const HandEyeResult& result);

/// Reprojection RMS (px, each coordinate) of views of one target that took no part in the solve, the arm's pose taken
/// as said.
[[nodiscard]] double reprojection_rms(const CameraIntrinsics& camera, const BoardSpec& board,
                                      std::span<const CalibrationView> views,
                                      const Transform<Flange, Camera>& flange_T_camera,
                                      const Transform<Base, Board>& base_T_board);

/// Largest distance from the camera at which an error of 3 sigma in every axis stays within `tolerance_m`: thesis
/// eq. 7-2, (tolerance - |x| - |y| - |z|) / sqrt(tan^2 P + tan^2 Y), rotation about the optical axis left out. 0 when
/// the translation alone exceeds the tolerance; at most 100 m.
[[nodiscard]] double usable_distance(const Transform<Flange, Camera>& flange_T_camera, const Matrix6d& covariance,
                                     double tolerance_m);

/// Eq. 7-2 itself for given errors: translation m, pitch and yaw rad.
[[nodiscard]] double usable_distance_of_errors(const Eigen::Vector3d& translation_m, double pitch_rad, double yaw_rad,
                                               double tolerance_m);

/// Standard deviation (m) of where a point `distance_m` ahead of the camera is thought to be, the worst direction.
[[nodiscard]] double point_sigma(const Transform<Flange, Camera>& flange_T_camera, const Matrix6d& covariance,
                                 double distance_m);

}  // namespace firstlook
