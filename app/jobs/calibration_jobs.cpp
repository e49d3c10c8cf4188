/// Jobs of the calibration: the next view of the board, the solve, the verdict.
#include <algorithm>

#include "algorithms/calibration/view_spread.hpp"
#include "algorithms/view_planning/fixed_views.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "app/jobs/workbench.hpp"

namespace firstlook {
namespace {
constexpr double kCrowded_rad = 0.1;        // joint distance of views where there is no room for more
constexpr std::size_t kIndependentMin = 6;  // of so many views a solve can make something
constexpr std::size_t kBootstrapViews = 4;  // three motions determine a rough transform, one more for a bad view
}  // namespace

/// The views that count: those that share an arm deviation with a later one are left out, unless few would remain.
std::vector<std::size_t> Workbench::independent_observations() const {
  std::vector<JointVector> configurations;
  for (const Observation& o : observations_) configurations.push_back(o.joints_rad);
  const auto apart = spread_views(configurations);
  return apart.size() >= kIndependentMin ? apart : spread_views(configurations, 0);
}

std::vector<CalibrationView> Workbench::views() const {
  std::vector<CalibrationView> views;
  for (const std::size_t i : independent_observations()) views.push_back(observations_[i].view);
  return views;
}

ArmSigma Workbench::arm_sigma_expected() const {
  return {config_.calibration.robot_sigma_mm * 1e-3, config_.calibration.robot_sigma_mrad * 1e-3};
}

const CameraIntrinsics& Workbench::camera() const {
  if (hand_eye_ && hand_eye_->intrinsics) return hand_eye_->camera;
  if (facts_.stored && estimates_intrinsics()) return facts_.stored->intrinsics;
  return color_.intrinsics();
}

HandEyeOptions Workbench::solve_options() const {
  HandEyeOptions options;
  options.solver = find_solver(config_.calibration.solver).value_or(Solver::kParkMartin);
  options.seed = static_cast<std::uint64_t>(config_.seed);
  options.refinement.arm_sigma_expected = arm_sigma_expected();
  if (estimates_intrinsics()) options.refinement.intrinsics = EstimatedIntrinsics::kWithoutK3;
  VerdictLimits& limits = options.limits;
  limits.views_min = std::min(config_.calibration.views_min, 6);
  limits.sigma_translation_max_m = config_.calibration.sigma_max_mm * 1e-3;
  limits.sigma_rotation_max_rad = config_.calibration.sigma_max_mrad * 1e-3;
  limits.holdout_rms_max_px = config_.calibration.holdout_rms_max_px;
  limits.subset_spread_max_m = config_.calibration.subset_spread_max_mm * 1e-3;
  limits.voxel_size_m = config_.map.resolution_m;
  limits.tolerance_m = config_.calibration.gripper_tolerance_m;
  limits.usable_distance_min_m = config_.calibration.usable_distance_min_m;
  limits.touch.error_max_m = config_.calibration.touch_error_max_mm * 1e-3;
  limits.touch.error_max_rad = config_.calibration.touch_error_max_mrad * 1e-3;
  return options;
}

/// What the views taken so far say about hand-eye and board; empty until they determine it.
std::optional<Workbench::RoughModel> Workbench::rough_model() const {
  if (observations_.size() < kBootstrapViews) return std::nullopt;
  std::vector<PosePair> pairs;
  for (const Observation& o : observations_) pairs.push_back({o.view.base_T_flange, o.pose.camera_T_board});
  const auto rough = solve_closed_form(pairs);
  if (!rough) return std::nullopt;
  RoughModel result;
  ViewDesignModel& model = result.model;
  model.camera = color_.intrinsics();
  model.board = board_;
  model.flange_T_camera = *rough;
  model.base_T_board = mean_board_pose(pairs, *rough);
  model.corner_sigma_px = config_.calibration.corner_sigma_px;
  model.arm_sigma = arm_sigma_expected();
  RefinementOptions options;
  const bool measured = observations_.size() >= kIndependentMin;
  options.corner_sigma_px = measured ? 0 : model.corner_sigma_px;
  options.arm_sigma = model.arm_sigma;
  options.rounds_max = measured ? 3 : 1;
  std::vector<CalibrationView> taken;
  for (const Observation& o : observations_) taken.push_back(o.view);
  const auto adopt = [&](const Refinement& refined) {
    model.camera = refined.camera;
    model.flange_T_camera = refined.flange_T_camera;
    model.base_T_board = refined.base_T_board;
    model.corner_sigma_px = refined.corner_sigma_px;
    if (refined.intrinsics) result.covariance = refined.covariance;
  };
  if (estimates_intrinsics()) {
    options.intrinsics = EstimatedIntrinsics::kWithoutK3;
    if (const auto refined = refine_hand_eye(model.camera, board_, taken, *rough, options)) {
      adopt(*refined);
      return result;
    }
    options.intrinsics = EstimatedIntrinsics::kNone;  // too few views yet: as if the stated ones were right
  }
  if (const auto refined = refine_hand_eye(model.camera, board_, taken, *rough, options)) adopt(*refined);
  return result;
}

CalibrationViewResult Workbench::next_bootstrap_view(const FromHere& here) {
  CalibrationViewResult result;
  const FreeSpace space = space_of(MotionPhase::kBeforeCalibration);
  if (bootstrap_.empty()) bootstrap_.push_back(here.at_rad);  // where the board was seen is a view, too
  // Around where the arm is now, then around each view that saw the board, until enough views did.
  while (bootstrap_next_ == bootstrap_.size() && bootstrap_centers_ <= observations_.size() && !bootstrap_.full()) {
    const JointVector center = bootstrap_centers_ == 0 ? here.at_rad : observations_[bootstrap_centers_ - 1].joints_rad;
    ++bootstrap_centers_;
    const auto views = bootstrap_views(arm_, envelope_body_, space, blind_terms_.clearance(), center);
    if (!views) continue;
    for (const JointVector& q : *views) {
      if (!bootstrap_.full()) bootstrap_.push_back(q);
    }
  }
  while (bootstrap_next_ < bootstrap_.size()) {
    const JointVector target = bootstrap_[bootstrap_next_++];
    const auto path = planner_.plan(arm_, envelope_body_, space, blind_terms_.clearance(), here.at_rad, target,
                                    {.seed = here.step + 1, .limits = limits_});
    if (!path) continue;
    result.found = true;
    result.path = route_of(*path, envelope_body_, limits_);
    return result;
  }
  return result;
}

CalibrationViewResult Workbench::next_calibration_view(const FromHere& here) {
  const auto rough = rough_model();
  if (!rough) return next_bootstrap_view(here);
  const ViewDesignModel& model = rough->model;
  Matrix12d information = prior_information();
  std::vector<JointVector> taken;
  for (const std::size_t i : independent_observations()) {
    information += view_information(model, observations_[i].view.base_T_flange);
    taken.push_back(observations_[i].joints_rad);
  }
  CalibrationViewOptions options;
  options.seed = static_cast<std::uint64_t>(config_.seed);
  options.step = here.step;
  options.speed = limits_;
  const FreeSpace space = space_of(MotionPhase::kBeforeCalibration);
  const Clearance clearance = blind_terms_.clearance();
  const CalibrationViewInputs inputs{arm_, envelope_body_, space, clearance, model, information, taken};
  const bool fixed = config_.calibration.views == "fixed48";
  CalibrationViewResult result;
  const PredictedSigma sigma = predicted_sigma(rough->covariance.value_or(predicted_covariance(information)));
  result.sigma_mm = 1000 * sigma.translation_m;
  result.sigma_mrad = 1000 * sigma.rotation_rad;
  const bool can_tell = rough->covariance.has_value() || !estimates_intrinsics();
  result.target_met = can_tell && !fixed && result.sigma_mm <= config_.calibration.target_sigma_mm &&
                      result.sigma_mrad <= config_.calibration.target_sigma_mrad;
  auto choice = fixed ? next_fixed_view(inputs, planner_, here.at_rad, fixed_next_, options)
                      : firstlook::next_calibration_view(inputs, planner_, here.at_rad, options);
  const auto found = [&] { return choice && choice->outcome == CalibrationViewChoice::Outcome::kChosen; };
  const bool too_few = observations_.size() < static_cast<std::size_t>(config_.calibration.views_min);
  if (!found() && too_few) {
    options.different_min_rad = kCrowded_rad;  // few places see the board: views side by side are better than none
    choice = firstlook::next_calibration_view(inputs, planner_, here.at_rad, options);
  }
  if (found()) {
    result.found = true;
    result.path = route_of(choice->path, envelope_body_, limits_);
  } else if (too_few) {
    return next_bootstrap_view(here);
  }
  return result;
}

SolveResult Workbench::solve() {
  SolveResult result;
  const auto solved = solve_hand_eye(color_.intrinsics(), board_, views(), solve_options());
  if (!solved) {
    result.fault = solved.error().fault;
    return result;
  }
  hand_eye_ = *solved;
  result.solved = true;
  const Eigen::Vector3d t = solved->flange_T_camera.translation();
  const Eigen::Quaterniond q = solved->flange_T_camera.quaternion();
  result.translation_m = {t.x(), t.y(), t.z()};
  result.quaternion_xyzw = {q.x(), q.y(), q.z(), q.w()};
  result.sigma_mm = 1000 * solved->sigma_translation_m.norm();
  result.sigma_mrad = 1000 * solved->sigma_rotation_rad.norm();
  result.reprojection_rms_px = solved->reprojection_rms_px;
  align_sensors();
  if (const auto& depth = alignment_.depth_camera.estimate) {
    result.depth_estimated = true;
    result.depth_moved_mm = 1000 * depth->moved.head<3>().norm();
    result.depth_moved_mrad = 1000 * depth->moved.tail<3>().norm();
  }
  result.offsets = stamp_offsets();
  result.stamps_wrong = alignment_.color_stamps.contradicted || alignment_.depth_stamps.contradicted;
  return result;
}

ValidateResult Workbench::validate() {
  ValidateResult result;
  if (!hand_eye_) return result;
  validate_hand_eye(color_.intrinsics(), board_, views(), solve_options(), *hand_eye_);
  result.accepted = hand_eye_->verdict == Verdict::kAccepted;
  result.holdout_rms_px = hand_eye_->holdout_rms_px;
  result.usable_distance_m = hand_eye_->usable_distance_m;
  if (result.accepted && tests_by_touch()) {
    hand_eye_->verdict = Verdict::kRejected;  // until somebody has touched the board
    hand_eye_->reasons = {"the touch test was not carried on"};
  } else if (result.accepted) {
    begin_mapping();
    result.clearance_m = mapping_terms_->voxels_m;
  }
  return result;
}

std::vector<CalibrationViewRecord> Workbench::calibration_records() const {
  std::vector<CalibrationViewRecord> records;
  const CameraIntrinsics& camera = this->camera();
  const std::vector<std::size_t> counted = independent_observations();
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    const auto place = std::find(counted.begin(), counted.end(), i);
    const auto k = static_cast<std::size_t>(place - counted.begin());  // its number in the solve
    const Observation& o = observations_[i];
    CalibrationViewRecord r;
    r.time_s = o.time_s;
    r.joints_rad = o.joints_rad;
    r.base_T_flange = o.view.base_T_flange;
    r.detected_px = o.view.corners_px;
    r.detected_ids = o.view.ids;
    r.rms_px = o.residual_rms_px;
    r.settling = o.settling;
    if (hand_eye_) {
      r.counted = place != counted.end();
      if (k < hand_eye_->fits.size()) r.used = hand_eye_->fits[k].used;
      if (k < hand_eye_->holdout_px.size()) r.holdout_px = hand_eye_->holdout_px[k];
      const auto camera_T_board =
          (o.view.base_T_flange * hand_eye_->flange_T_camera).inverse() * hand_eye_->base_T_board;
      for (std::size_t c = 0; c < o.view.corners_px.size(); ++c) {
        const auto pixel = project(camera, camera_T_board * board_.corner(point_of(o.view.ids, c)));
        r.reprojected_px.push_back(pixel.value_or(Eigen::Vector2d(-1, -1)));
      }
      double sum = 0;
      for (std::size_t c = 0; c < r.detected_px.size(); ++c) {
        sum += (r.detected_px[c] - r.reprojected_px[c]).squaredNorm();
      }
      r.rms_px = std::sqrt(sum / (2.0 * static_cast<double>(r.detected_px.size())));
    }
    const std::size_t pixels = gray_.size();
    if ((i + 1) * pixels <= pictures_.size()) {
      const auto from = pictures_.items().subspan(i * pixels, pixels);
      if (std::any_of(from.begin(), from.end(), [](std::uint8_t v) { return v != 0; })) {
        r.picture = {camera.width, camera.height, {from.begin(), from.end()}};
      }
    }
    records.push_back(std::move(r));
  }
  return records;
}

}  // namespace firstlook
