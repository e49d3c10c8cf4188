/// Jobs of the calibration: the next view of the board, the solve, the verdict.
#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/calibration/view_spread.hpp"
#include "algorithms/view_planning/fixed_views.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "app/jobs/workbench.hpp"

namespace firstlook {
namespace {
constexpr double kViewStop_s = 3;           // what a view costs beside its move; with 2 to 7 it comes to much the same
constexpr double kCrowded_rad = 0.1;        // joint distance of views where there is no room for more
constexpr std::size_t kIndependentMin = 6;  // of so many views a solve can make something
constexpr std::size_t kBootstrapViews = 4;  // three motions determine a rough transform, one more for a bad view
}  // namespace

/// The views that count: those of stops that share an arm deviation with a later one are left out, unless few would
/// remain.
std::vector<std::size_t> Workbench::independent_observations() const {
  std::vector<JointVector> configurations(stops());
  for (const Observation& o : observations_) configurations[static_cast<std::size_t>(o.view.station)] = o.joints_rad;
  auto apart = spread_views(configurations);
  if (apart.size() < kIndependentMin) apart = spread_views(configurations, 0);
  std::vector<std::size_t> independent;
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    const auto stop = static_cast<std::size_t>(observations_[i].view.station);
    if (std::ranges::binary_search(apart, stop)) independent.push_back(i);
  }
  return independent;
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
  limits.gated_last_max = 0;  // nobody watches; where it is the only one, the machine takes more views
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

/// The models of the targets whose place is known, from views or, roughly, from where they were located.
void Workbench::place_targets(const ViewDesignModel& common, const std::vector<PosePair>& pairs,
                              std::span<const TargetPose> refined, RoughModel& rough) const {
  for (std::size_t k = 0; k < boards_.size(); ++k) {
    const std::vector<PosePair> own = pairs_of_target(pairs, static_cast<int>(k));
    ViewDesignModel model = common;
    model.board = boards_[k];
    if (k < refined.size() && refined[k].views > 0) {
      model.base_T_board = refined[k].base_T_board;
    } else if (!own.empty()) {
      model.base_T_board = mean_board_pose(own, common.flange_T_camera);
    } else if (located_[k]) {
      model.base_T_board = located_[k]->base_T_flange * common.flange_T_camera * located_[k]->camera_T_board;
    } else {
      continue;
    }
    rough.models.push_back(model);
    rough.targets.push_back(static_cast<int>(k));
  }
}

/// What the views taken so far say about hand-eye and boards; empty until they determine it.
std::optional<Workbench::RoughModel> Workbench::rough_model() const {
  if (stops() < kBootstrapViews) return std::nullopt;
  std::vector<PosePair> pairs;
  for (const Observation& o : observations_) {
    pairs.push_back({o.view.base_T_flange, o.pose.camera_T_board, o.view.target, o.view.station});
  }
  const auto closed_form = solve_closed_form(pairs);
  if (!closed_form) return std::nullopt;
  RoughModel result;
  ViewDesignModel model;
  model.camera = color_.intrinsics();
  model.flange_T_camera = *closed_form;
  model.corner_sigma_px = config_.calibration.corner_sigma_px;
  model.arm_sigma = arm_sigma_expected();
  RefinementOptions options;
  const bool measured = stops() >= kIndependentMin;
  options.corner_sigma_px = measured ? 0 : model.corner_sigma_px;
  options.arm_sigma = model.arm_sigma;
  options.rounds_max = measured ? 3 : 1;
  std::vector<CalibrationView> taken;
  for (const Observation& o : observations_) taken.push_back(o.view);
  const auto adopt = [&](const Refinement& refined) {
    model.camera = refined.camera;
    model.flange_T_camera = refined.flange_T_camera;
    model.corner_sigma_px = refined.corner_sigma_px;
    if (refined.intrinsics) result.covariance = refined.covariance;
    place_targets(model, pairs, refined.targets, result);
  };
  if (estimates_intrinsics()) {
    options.intrinsics = EstimatedIntrinsics::kWithoutK3;
    if (const auto refined = refine_hand_eye(model.camera, boards_, taken, *closed_form, options)) {
      adopt(*refined);
      return result;
    }
    options.intrinsics = EstimatedIntrinsics::kNone;  // too few views yet: as if the stated ones were right
  }
  if (const auto refined = refine_hand_eye(model.camera, boards_, taken, *closed_form, options)) {
    adopt(*refined);
  } else {
    place_targets(model, pairs, {}, result);
  }
  return result;
}

Eigen::MatrixXd Workbench::information_of(const RoughModel& rough, std::span<const std::size_t> observations) const {
  Eigen::MatrixXd information = joint_prior_information(rough.models.size());
  for (std::size_t i = 0; i < observations.size();) {
    const CalibrationView& first = observations_[observations[i]].view;
    std::uint32_t shown = 0;
    for (; i < observations.size() && observations_[observations[i]].view.station == first.station; ++i) {
      const int target = observations_[observations[i]].view.target;
      shown |= 1U << (std::ranges::find(rough.targets, target) - rough.targets.begin());
    }
    information += joint_view_information(rough.models, shown, first.base_T_flange);
  }
  return information;
}

/// A target that was seen from few places is placed by them alone: it gets some views for its own sake, unless they do
/// not show it.
std::uint32_t Workbench::wanted_targets(const RoughModel& rough, std::span<const std::size_t> observations) const {
  constexpr std::ptrdiff_t kViewsWanted = 4;
  constexpr int kTriesMax = 6;
  if (boards_.size() == 1) return 0;
  std::uint32_t wanted = 0;
  for (std::size_t m = 0; m < rough.targets.size(); ++m) {
    const int target = rough.targets[m];
    const auto views =
        std::ranges::count_if(observations, [&](std::size_t i) { return observations_[i].view.target == target; });
    if (views < kViewsWanted && sought_[static_cast<std::size_t>(target)] < kTriesMax) wanted |= 1U << m;
  }
  return wanted;
}

/// What came of the looks so far, with targets numbered as the models are.
std::vector<BoardLookOutcome> Workbench::look_outcomes(const RoughModel& rough) const {
  std::vector<BoardLookOutcome> outcomes;
  for (const CollectLook& look : collect_looks_) {
    BoardLookOutcome& outcome = outcomes.emplace_back(forward(arm_, look.at_rad).flange());
    for (std::size_t m = 0; m < rough.targets.size(); ++m) {
      outcome.expected |= (look.expected >> rough.targets[m] & 1U) << m;
      outcome.seen |= (look.seen >> rough.targets[m] & 1U) << m;
    }
  }
  return outcomes;
}

CalibrationViewResult Workbench::next_bootstrap_view(const FromHere& here) {
  CalibrationViewResult result;
  targets_expected_ = 0;
  const FreeSpace space = space_of(MotionPhase::kBeforeCalibration);
  if (bootstrap_.empty()) bootstrap_.push_back(here.at_rad);  // where the board was seen is a view, too
  // Around where the arm is now, then around each view that saw the board, until enough views did.
  while (bootstrap_next_ == bootstrap_.size() && bootstrap_centers_ <= stops() && !bootstrap_.full()) {
    const auto at_stop = [&](const Observation& o) {
      return static_cast<std::size_t>(o.view.station) + 1 == bootstrap_centers_;
    };
    const JointVector center =
        bootstrap_centers_ == 0 ? here.at_rad : std::ranges::find_if(observations_, at_stop)->joints_rad;
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

/// Where the board was seen from by the views that count.
std::vector<JointVector> Workbench::places_of(std::span<const std::size_t> counted) const {
  std::vector<JointVector> taken;
  for (std::size_t k = 0; k < counted.size(); ++k) {
    const Observation& o = observations_[counted[k]];
    const bool same = k > 0 && observations_[counted[k - 1]].view.station == o.view.station;
    if (!same) taken.push_back(o.joints_rad);
  }
  return taken;
}

CalibrationViewOptions Workbench::calibration_view_options(const FromHere& here) const {
  CalibrationViewOptions options;
  options.seed = static_cast<std::uint64_t>(config_.seed);
  options.step = here.step;
  options.speed = limits_;
  options.stop_s = kViewStop_s;
  return options;
}

/// How sure the views make the transform, and whether that is enough.
void Workbench::note_sigma(const RoughModel& rough, const Eigen::MatrixXd& information,
                           CalibrationViewResult& result) const {
  const PredictedSigma sigma = predicted_sigma(rough.covariance.value_or(predicted_hand_eye(information)));
  result.sigma_mm = 1000 * sigma.translation_m;
  result.sigma_mrad = 1000 * sigma.rotation_rad;
  const bool can_tell = rough.covariance.has_value() || !estimates_intrinsics();
  result.target_met = can_tell && result.sigma_mm <= config_.calibration.target_sigma_mm &&
                      result.sigma_mrad <= config_.calibration.target_sigma_mrad;
}

/// The view after the one that the arm is under way to, if that one shows what is expected: found where there is one
/// board, whose views are chosen, and enough of them to believe the model; or the target met.
CalibrationViewResult Workbench::calibration_view_after_look(const FromHere& here) {
  CalibrationViewResult result;
  if (boards_.size() > 1 || config_.calibration.views == "fixed48" || stops() < kIndependentMin) return result;
  const auto rough = rough_model();
  if (!rough || rough->models.size() != 1) return result;
  const std::vector<std::size_t> counted = independent_observations();
  std::vector<JointVector> taken = places_of(counted);
  taken.push_back(here.at_rad);
  const auto base_T_flange = forward(arm_, here.at_rad).flange();
  const Eigen::MatrixXd information =
      information_of(*rough, counted) + joint_view_information(rough->models, 1, base_T_flange);
  note_sigma(*rough, information, result);
  const std::vector<BoardLookOutcome> looks = look_outcomes(*rough);
  const FreeSpace space = space_of(MotionPhase::kBeforeCalibration);
  const Clearance clearance = blind_terms_.clearance();
  const CalibrationViewInputs inputs{arm_, envelope_body_, space, clearance, rough->models, information, taken, looks};
  const auto choice = firstlook::next_calibration_view(inputs, planner_, here.at_rad, calibration_view_options(here));
  if (!choice || choice->outcome != CalibrationViewChoice::Outcome::kChosen) return result;
  result.found = true;
  result.path = route_of(choice->path, envelope_body_, limits_);
  return result;
}

CalibrationViewResult Workbench::next_calibration_view(const FromHere& here) {
  publish_blind(here.now_s, MotionPhase::kBeforeCalibration);
  if (here.after_look) return calibration_view_after_look(here);
  const auto rough = rough_model();
  if (!rough) return next_bootstrap_view(here);
  const std::vector<std::size_t> counted = independent_observations();
  const std::vector<JointVector> taken = places_of(counted);
  CalibrationViewOptions options = calibration_view_options(here);
  const bool fixed = config_.calibration.views == "fixed48";
  options.wanted = fixed ? 0 : wanted_targets(*rough, counted);
  const FreeSpace space = space_of(MotionPhase::kBeforeCalibration);
  const Clearance clearance = blind_terms_.clearance();
  const std::vector<BoardLookOutcome> looks = look_outcomes(*rough);
  const CalibrationViewInputs inputs{
      arm_, envelope_body_, space, clearance, rough->models, information_of(*rough, counted), taken, looks};
  CalibrationViewResult result;
  note_sigma(*rough, inputs.information, result);
  auto choice = fixed ? next_fixed_view(inputs, planner_, here.at_rad, fixed_next_, options)
                      : firstlook::next_calibration_view(inputs, planner_, here.at_rad, options);
  const auto found = [&] { return choice && choice->outcome == CalibrationViewChoice::Outcome::kChosen; };
  if (options.wanted != 0) {
    // None of those that want views can be seen from anywhere else: they are not asked for again.
    const std::uint32_t sought = found() ? choice->shown & options.wanted : options.wanted;
    for (std::size_t m = 0; m < rough->targets.size(); ++m) {
      if ((sought >> m & 1U) == 0) continue;
      int& tries = sought_[static_cast<std::size_t>(rough->targets[m])];
      tries = found() ? tries + 1 : std::numeric_limits<int>::max();
    }
    if (!found()) {
      options.wanted = 0;
      choice = firstlook::next_calibration_view(inputs, planner_, here.at_rad, options);
    }
  }
  result.target_met = result.target_met && !fixed && options.wanted == 0;
  const bool too_few = stops() < static_cast<std::size_t>(config_.calibration.views_min);
  if (!found() && too_few) {
    options.different_min_rad = kCrowded_rad;  // few places see the board: views side by side are better than none
    choice = firstlook::next_calibration_view(inputs, planner_, here.at_rad, options);
  }
  if (found()) {
    targets_expected_ = 0;
    for (std::size_t m = 0; m < rough->targets.size(); ++m) {
      targets_expected_ |= static_cast<TargetMask>((choice->shown >> m & 1U) << rough->targets[m]);
    }
    result.found = true;
    result.path = route_of(choice->path, envelope_body_, limits_);
  } else if (too_few) {
    return next_bootstrap_view(here);
  }
  return result;
}

SolveResult Workbench::solve() {
  SolveResult result;
  const auto solved = solve_hand_eye(color_.intrinsics(), boards_, views(), solve_options());
  if (!solved) {
    result.fault = solved.error().fault;
    return result;
  }
  hand_eye_ = *solved;
  result.solved = true;
  result.targets = solved_targets();
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
  validate_hand_eye(color_.intrinsics(), boards_, views(), solve_options(), *hand_eye_,
                    [this](int n, IndexedBody body) { spread_over_workers(n, body); });
  result.accepted = hand_eye_->verdict == Verdict::kAccepted;
  result.more_views_tell = hand_eye_->only_last_contradicts;
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

void Workbench::reproject(const CalibrationView& view, CalibrationViewRecord& record) const {
  const auto& base_T_board = hand_eye_->targets[static_cast<std::size_t>(view.target)].base_T_board;
  const auto camera_T_board = (view.base_T_flange * hand_eye_->flange_T_camera).inverse() * base_T_board;
  double sum = 0;
  for (std::size_t c = 0; c < view.corners_px.size(); ++c) {
    const auto pixel = project(camera(), camera_T_board * board(view.target).corner(point_of(view.ids, c)));
    record.reprojected_px.push_back(pixel.value_or(Eigen::Vector2d(-1, -1)));
    sum += (view.corners_px[c] - record.reprojected_px.back()).squaredNorm();
  }
  record.rms_px = std::sqrt(sum / (2.0 * static_cast<double>(view.corners_px.size())));
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
    const auto target = static_cast<std::size_t>(o.view.target);
    if (targets_.size() > 1) r.name = fmt::format("{:.0f} s, {}", o.time_s, targets_[target].name);
    r.target = o.view.target;
    r.station = o.view.station;
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
      if (target < hand_eye_->targets.size() && hand_eye_->targets[target].views > 0) reproject(o.view, r);
    }
    const std::size_t pixels = gray_.size();
    const auto stop = static_cast<std::size_t>(o.view.station);
    if ((stop + 1) * pixels <= pictures_.size()) {
      const auto from = pictures_.items().subspan(stop * pixels, pixels);
      if (std::any_of(from.begin(), from.end(), [](std::uint8_t v) { return v != 0; })) {
        r.picture = {camera.width, camera.height, {from.begin(), from.end()}};
      }
    }
    records.push_back(std::move(r));
  }
  return records;
}

}  // namespace firstlook
