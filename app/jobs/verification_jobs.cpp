/// Jobs that test a stored calibration: where to look from, and whether it holds.
#include <algorithm>
#include <numeric>
#include <set>

#include "algorithms/calibration/verification.hpp"
#include "app/jobs/workbench.hpp"

namespace firstlook {
namespace {

/// What the file says, as the result of a job that is still to be verified.
HandEyeResult result_of(const StoredCalibration& stored, double tolerance_m) {
  HandEyeResult r;
  r.camera = stored.intrinsics;
  r.flange_T_camera = stored.flange_T_camera;
  r.closed_form = stored.flange_T_camera;
  r.covariance = stored.covariance;
  r.sigma_translation_m = stored.covariance.diagonal().head<3>().cwiseSqrt();
  r.sigma_rotation_rad = stored.covariance.diagonal().tail<3>().cwiseSqrt();
  r.reprojection_rms_px = stored.reprojection_rms_px;
  r.corner_sigma_px = stored.corner_sigma_px;
  r.arm_sigma = stored.arm_sigma;
  r.views = stored.views;
  r.usable_distance_m = usable_distance(stored.flange_T_camera, stored.covariance, tolerance_m);
  return r;
}

std::vector<PosePair> pairs_of(std::span<const Observation> observations) {
  std::vector<PosePair> pairs;
  for (const Observation& o : observations) {
    pairs.push_back({o.view.base_T_flange, o.pose.camera_T_board, o.view.target, o.view.station});
  }
  return pairs;
}

VerificationLimits limits_of(const Config& config) {
  VerificationLimits limits;
  limits.views_min = config.calibration.verify_views;
  return limits;
}

}  // namespace

/// The noise that the calibration was made with, the arm's not below what the configuration expects: few views know the
/// arm's sigma only roughly.
HandEyeClaim Workbench::claim() const {
  const StoredCalibration& stored = *facts_.stored;
  return {stored.flange_T_camera,
          stored.covariance,
          stored.corner_sigma_px,
          {std::max(stored.arm_sigma.translation_m, config_.calibration.robot_sigma_mm * 1e-3),
           std::max(stored.arm_sigma.rotation_rad, config_.calibration.robot_sigma_mrad * 1e-3)}};
}

Workbench::RoughModel Workbench::claimed_model(const HandEyeClaim& stated) const {
  RoughModel rough;
  ViewDesignModel model;
  model.camera = camera();
  model.flange_T_camera = stated.flange_T_camera;
  model.corner_sigma_px = stated.corner_sigma_px;
  model.arm_sigma = stated.arm_sigma;
  place_targets(model, pairs_of(observations_), {}, rough);
  return rough;
}

std::optional<Path> Workbench::best_verification_view(const FromHere& here, const RoughModel& rough,
                                                      const Eigen::MatrixXd& information) {
  std::vector<JointVector> taken;
  for (const Observation& o : observations_) taken.push_back(o.joints_rad);
  CalibrationViewOptions options;
  options.seed = static_cast<std::uint64_t>(config_.seed);
  options.step = here.step;
  options.speed = limits_;
  options.criterion = DesignCriterion::kVolume;
  options.limits.margin_px = 60;  // 5 mm and 1 degree move the board by 15 px at 0.6 m
  const FreeSpace space = space_of(MotionPhase::kBeforeCalibration);
  const Clearance clearance = blind_terms_.clearance();
  const CalibrationViewInputs inputs{arm_, envelope_body_, space, clearance, rough.models, information, taken};
  const auto choice = firstlook::next_calibration_view(inputs, planner_, here.at_rad, options);
  if (!choice || choice->outcome != CalibrationViewChoice::Outcome::kChosen) return std::nullopt;
  return choice->path;
}

/// Small turns around where the board was seen: for a calibration that is so wrong that the board is not where it says.
std::optional<Path> Workbench::next_turn(const FromHere& here) {
  const FreeSpace space = space_of(MotionPhase::kBeforeCalibration);
  const Clearance clearance = blind_terms_.clearance();
  if (!turns_) {
    turns_.emplace();
    const JointVector& around = observations_.empty() ? here.at_rad : observations_.front().joints_rad;
    if (const auto turns = bootstrap_views(arm_, envelope_body_, space, clearance, around)) *turns_ = *turns;
  }
  while (turns_next_ < turns_->size()) {
    const JointVector target = (*turns_)[turns_next_++];
    const auto path = planner_.plan(arm_, envelope_body_, space, clearance, here.at_rad, target,
                                    {.seed = here.step + 1, .limits = limits_});
    if (path) return *path;
  }
  return std::nullopt;
}

VerificationViewResult Workbench::next_verification_view(const FromHere& here) {
  VerificationViewResult result;
  std::optional<Path> path;
  if (!observations_.empty()) {
    const HandEyeClaim stated = claim();
    const RoughModel rough = claimed_model(stated);
    std::vector<std::size_t> all(observations_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    const Eigen::MatrixXd information = information_of(rough, all);
    const VerificationLimits limits = limits_of(config_);
    if (static_cast<int>(stops()) >= limits.views_min) {
      std::set<int> seen;
      for (const Observation& o : observations_) seen.insert(o.view.target);
      const auto alike = static_cast<int>(observations_.size() + 1 - seen.size());
      const DetectableError detectable =
          detectable_error(predicted_hand_eye(information), stated.covariance, alike, limits);
      result.target_met = detectable.within(limits);
      result.detectable_mm = 1000 * detectable.translation_m;
      result.detectable_mrad = 1000 * detectable.rotation_rad;
    }
    if (verification_looks_ == stops()) path = best_verification_view(here, rough, information);
  }
  if (!path) path = next_turn(here);
  result.found = path.has_value();
  if (path) result.path = route_of(*path, envelope_body_, limits_);
  return result;
}

VerifyResult Workbench::verify_calibration() {
  VerifyResult result;
  HandEyeResult hand_eye = result_of(*facts_.stored, config_.calibration.gripper_tolerance_m);
  VerifiedCalibration record{*facts_.stored, static_cast<int>(verification_looks_), std::nullopt};
  hand_eye.reasons = covariance_reasons(solve_options().limits, hand_eye);
  std::vector<CalibrationView> views;
  for (const Observation& o : observations_) views.push_back(o.view);
  const auto verification = verify_hand_eye(camera(), boards_, views, claim(), limits_of(config_));
  if (verification) {
    record.verification = *verification;
    hand_eye.targets = verification->targets;
    hand_eye.holdout_rms_px = verification->residual_rms_px;
    hand_eye.holdout_rms_m = verification->residual_rms_m;
    hand_eye.reasons.insert(hand_eye.reasons.end(), verification->reasons.begin(), verification->reasons.end());
    result.chi2 = verification->chi2;
    result.chi2_limit = verification->chi2_limit;
    result.residual_rms_px = verification->residual_rms_px;
  } else {
    hand_eye.targets.resize(boards_.size());
    for (std::size_t k = 0; k < boards_.size(); ++k) {
      const auto own = pairs_of_target(pairs_of(observations_), static_cast<int>(k));
      if (own.empty()) continue;
      hand_eye.targets[k].views = static_cast<int>(own.size());
      hand_eye.targets[k].base_T_board = mean_board_pose(own, hand_eye.flange_T_camera);
    }
    hand_eye.reasons.emplace_back(verification.error().detail());
  }
  if (const std::size_t missed = verification_looks_ - stops(); missed > 0 && !hand_eye.reasons.empty()) {
    hand_eye.reasons.push_back(fmt::format("{} of {} looks did not show the board", missed, verification_looks_));
  }
  const auto first = std::ranges::find_if(hand_eye.targets, [](const TargetPose& t) { return t.views > 0; });
  if (first != hand_eye.targets.end()) {
    hand_eye.base_T_board = first->base_T_board;
    hand_eye.board_covariance = first->covariance;
  }
  result.accepted = hand_eye.reasons.empty();
  hand_eye.verdict = result.accepted ? Verdict::kAccepted : Verdict::kRejected;
  record.calibration.accepted = result.accepted;
  hand_eye_ = std::move(hand_eye);
  verified_ = std::move(record);
  result.targets = solved_targets();
  if (result.accepted) {
    begin_mapping();
    result.clearance_m = mapping_terms_->voxels_m;
    result.offsets = stamp_offsets();
  }
  return result;
}

}  // namespace firstlook
