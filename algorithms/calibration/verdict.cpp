#include "algorithms/calibration/verdict.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>

#include "algorithms/calibration/board_ambiguity.hpp"
#include "algorithms/calibration/intrinsics_misfit.hpp"
#include "algorithms/calibration/mistakes/placement_mistakes.hpp"
#include "algorithms/calibration/unobservable.hpp"
#include "algorithms/calibration/view_gate.hpp"
#include "algorithms/calibration/view_subsets.hpp"
#include "algorithms/vision/board_pose.hpp"
#include "algorithms/vision/camera_model.hpp"

namespace firstlook {
namespace {

using Indices = std::vector<std::size_t>;

/// What validation needs of a calibration, whether it came from corners or from pose pairs.
struct Validation {
  std::vector<PosePair> pairs;  ///< of the used views
  Indices given;                ///< which of the views given each of them is
  Indices station;              ///< the place of the arm that each was taken from
  std::size_t stations = 0;
  std::size_t views_given = 0;
  std::function<Result<Refinement>(const Indices&)> resolve;  ///< a short solve with some of them
  /// Sum of squared reprojection errors (px^2, both coordinates) of one view under a solution; empty without corners.
  std::function<double(std::size_t, const Refinement&)> squared_px;
  std::vector<double> corners;                 ///< seen in each of them
  std::vector<Eigen::Vector3d> board_centers;  ///< by target

  /// The views from some of the stations.
  [[nodiscard]] Indices views_of(const std::function<bool(std::size_t)>& has_station) const {
    Indices views;
    views.reserve(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (has_station(station[i])) views.push_back(i);
    }
    return views;
  }
};

/// Options of a short solve around a known one: its sigmas, one round, no gating.
RefinementOptions short_options(const HandEyeOptions& options, const HandEyeResult& result) {
  RefinementOptions quick = options.refinement;
  quick.corner_sigma_px = result.corner_sigma_px;
  quick.arm_sigma = result.arm_sigma;
  quick.rounds_max = 1;
  quick.iterations_max = 10;
  quick.view_gate = 1e12;
  return quick;
}

/// Each used view is predicted once by a solve without it: five interleaved groups are left out in turn.
void hold_out(const Validation& validation, HandEyeResult& result) {
  const std::size_t groups = std::min<std::size_t>(5, validation.stations);
  double squared_px = 0, squared_m = 0, views = 0, corners = 0;
  for (std::size_t group = 0; group < groups; ++group) {
    const auto solved = validation.resolve(validation.views_of([&](std::size_t s) { return s % groups != group; }));
    if (!solved) continue;
    for (const std::size_t i : validation.views_of([&](std::size_t s) { return s % groups == group; })) {
      const PosePair& pair = validation.pairs[i];
      const auto target = static_cast<std::size_t>(pair.target);
      if (solved->targets[target].views == 0) continue;  // no other view shows it
      const auto seen = pair.base_T_flange * solved->flange_T_camera * pair.camera_T_board;
      const Eigen::Vector3d& center = validation.board_centers[target];
      squared_m += (seen * center - solved->targets[target].base_T_board * center).squaredNorm();
      if (validation.squared_px) {
        const double view_px = validation.squared_px(i, *solved);
        squared_px += view_px;
        result.holdout_px[validation.given[i]] = std::sqrt(view_px / (2 * validation.corners[i]));
        corners += validation.corners[i];
      }
      views += 1;
    }
  }
  if (views == 0) return;
  result.holdout_rms_m = std::sqrt(squared_m / views);
  if (validation.squared_px) result.holdout_rms_px = std::sqrt(squared_px / (2 * corners));
}

/// Returns how many of the solves failed.
int spread_of_subsets(const Validation& validation, const HandEyeOptions& options, RunParallel run_parallel,
                      HandEyeResult& result) {
  ViewSubsets subsets(validation.stations, options.subset_share, options.seed);
  std::vector<Indices> drawn;
  for (int i = 0; i < options.subset_solves; ++i) drawn.push_back(subsets.next());
  std::vector<std::optional<Transform<Flange, Camera>>> solutions(drawn.size());
  run_parallel(static_cast<int>(drawn.size()), [&](int index, int) {
    const auto i = static_cast<std::size_t>(index);
    const auto is_drawn = [&](std::size_t s) { return std::binary_search(drawn[i].begin(), drawn[i].end(), s); };
    if (const auto solved = validation.resolve(validation.views_of(is_drawn))) solutions[i] = solved->flange_T_camera;
  });
  double squared_m = 0, squared_rad = 0;
  result.subset_solutions.clear();
  for (const auto& solution : solutions) {
    if (!solution) continue;
    result.subset_solutions.push_back(*solution);
    const Vector6d d = pose_difference(solution->pose(), result.flange_T_camera.pose());
    squared_m += d.head<3>().squaredNorm();
    squared_rad += d.tail<3>().squaredNorm();
  }
  const auto solved = static_cast<int>(result.subset_solutions.size());
  if (solved > 0) {
    result.subset_spread_m = std::sqrt(squared_m / solved);
    result.subset_spread_rad = std::sqrt(squared_rad / solved);
  }
  return options.subset_solves - solved;
}

struct Figure {
  double value, limit;
  double to_text;  ///< factor from SI to `unit`
  const char* text;
  const char* unit;
};

void reject_above(const Figure& f, std::vector<std::string>& reasons) {
  if (f.value <= f.limit) return;
  reasons.push_back(
      fmt::format("{} {:.3g} {}, allowed {:.3g} {}", f.text, f.value * f.to_text, f.unit, f.limit * f.to_text, f.unit));
}

/// Where one direction is much less sure than the next, it is named: views that turn about another axis would tell it.
std::string weakest_direction(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
  constexpr double kMuchLess = 3;  // sigmas
  if (!(axes.eigenvalues()[2] > kMuchLess * kMuchLess * axes.eigenvalues()[1])) return {};
  const Eigen::Vector3d d = axes.eigenvectors().col(2);
  return fmt::format(
      " (nearly all of it along ({:.2f}, {:.2f}, {:.2f}) of the flange: add views that turn the arm by 20 "
      "degrees or more about another axis)",
      d.x() + 0.0, d.y() + 0.0, d.z() + 0.0);
}

void judge(const VerdictLimits& limits, int failed_subsets, int subset_solves, HandEyeResult& result) {
  std::vector<std::string>& reasons = result.reasons;
  reasons.clear();
  result.only_last_contradicts = false;
  const auto gated = std::count_if(result.fits.begin(), result.fits.end(), [](const ViewFit& f) { return !f.used; });
  if (result.views < limits.views_min) {
    reasons.push_back(fmt::format("{} usable views, {} are the least", result.views, limits.views_min));
  }
  if (static_cast<double>(gated) > limits.gated_views_max * static_cast<double>(result.fits.size())) {
    reasons.push_back(fmt::format("{} of {} views contradict the others", gated, result.fits.size()));
  } else if (gated > 0) {
    // In the order in which they were taken.
    const auto used = [](const ViewFit& f) { return f.used; };
    const auto first_used = std::ranges::find_if(result.fits, used);
    const auto before = std::distance(result.fits.begin(), first_used);
    const auto last_used = std::find_if(result.fits.rbegin(), result.fits.rend(), used);
    const auto after = std::distance(result.fits.rbegin(), last_used);
    const bool first_wrong = before == gated && gated > limits.gated_first_max;
    const bool last_wrong = after == gated && gated > limits.gated_last_max;
    if (first_wrong || last_wrong) {
      reasons.push_back(fmt::format(
          "the {} {} of {} views contradict all others: the board, or the camera on the arm, was moved in between",
          last_wrong ? "last" : "first", gated, result.fits.size()));
    }
    result.only_last_contradicts = last_wrong && gated == 1;
  }
  if (result.holdout_rms_m == 0) {
    reasons.emplace_back("too few views to hold any out");
  } else {
    reject_above({result.holdout_rms_px, limits.holdout_rms_max_px, 1, "held-out views miss by RMS", "px"}, reasons);
    reject_above({result.holdout_rms_m, limits.holdout_rms_max_m, 1e3, "held-out views see the board off by RMS", "mm"},
                 reasons);
  }
  reject_above(
      {result.subset_spread_m, limits.subset_spread_max_m, 1e3, "solves on subsets of the views spread by RMS", "mm"},
      reasons);
  if (2 * failed_subsets > subset_solves) {
    reasons.push_back(fmt::format("{} of {} solves on subsets of the views failed", failed_subsets, subset_solves));
  }
  for (std::string& reason : covariance_reasons(limits, result)) reasons.push_back(std::move(reason));
  result.verdict = reasons.empty() ? Verdict::kAccepted : Verdict::kRejected;
}

void validate(Validation& validation, const HandEyeOptions& options, RunParallel run_parallel, HandEyeResult& result) {
  result.holdout_rms_px = result.holdout_rms_m = 0;
  result.subset_spread_m = result.subset_spread_rad = 0;
  result.holdout_px.clear();
  validation.station = stations_of(validation.pairs);
  validation.stations = station_count(validation.station);
  if (validation.squared_px) result.holdout_px.resize(validation.views_given);
  hold_out(validation, result);
  const int failed = spread_of_subsets(validation, options, run_parallel, result);
  result.usable_distance_m = usable_distance(result.flange_T_camera, result.covariance, options.limits.tolerance_m);
  judge(options.limits, failed, options.subset_solves, result);
}

/// A degenerate motion with what it leaves open, any other error as it is.
std::unexpected<Error> name_unobservable(const Error& error, std::span<const PosePair> pairs) {
  if (error.fault != Fault::kDegenerateMotion) return std::unexpected(error);
  const std::string text = unobservable_text(unobservable_of(pairs));
  if (text.empty()) return std::unexpected(error);
  return failure(Fault::kDegenerateMotion, "{} views: {}", pairs.size(), text);
}

/// Says what is wrong with the data where that can be told: with the whole of a rejected set, or with single views that
/// were left out.
void name_mistake(std::span<const PosePair> pairs, const BoardSpec* board, const std::function<MistakeSearch()>& search,
                  HandEyeResult& result) {
  result.likely_mistake.reset();
  std::vector<bool> kept;
  for (const ViewFit& fit : result.fits) kept.push_back(fit.used);
  if (result.verdict == Verdict::kRejected) {
    MistakeSearch found = search();
    result.likely_mistake = std::move(found.found);
    if (!result.likely_mistake && found.tried > 0) result.reasons.push_back(found.sentence());
  }
  if (!result.likely_mistake && pairs.size() == kept.size()) {
    std::string text = mistakes::explain_left_out(pairs, kept, result.flange_T_camera, board);
    if (!text.empty()) {
      result.likely_mistake = LikelyMistake{Mistake::kSingleViews, "likely mistake: " + std::move(text), {}, {}};
    }
  }
  if (result.likely_mistake && result.verdict == Verdict::kRejected) {
    result.reasons.push_back(result.likely_mistake->text);
  }
}

/// Rejects a calibration whose views tell that the given intrinsics lead it astray.
void name_wrong_intrinsics(const CameraIntrinsics& given, const Targets& targets,
                           std::span<const CalibrationView> views, const HandEyeOptions& options,
                           HandEyeResult& result) {
  const std::string text =
      intrinsics_misfit(given, targets, views, options.refinement, {result.flange_T_camera, result.covariance});
  if (text.empty()) return;
  result.likely_mistake = LikelyMistake{Mistake::kIntrinsics, "likely mistake: " + text, {}, {}};
  result.reasons.push_back(result.likely_mistake->text);
  result.verdict = Verdict::kRejected;
}

HandEyeResult start_result(const Refinement& refinement, std::span<const PosePair> used_pairs) {
  HandEyeResult result;
  result.camera = refinement.camera;
  result.intrinsics = refinement.intrinsics;
  result.flange_T_camera = refinement.flange_T_camera;
  result.base_T_board = refinement.base_T_board;
  result.targets = refinement.targets;
  result.joint_covariance = refinement.joint_covariance;
  result.covariance = refinement.covariance;
  result.board_covariance = refinement.board_covariance;
  result.sigma_translation_m = refinement.covariance.diagonal().head<3>().cwiseMax(0).cwiseSqrt();
  result.sigma_rotation_rad = refinement.covariance.diagonal().tail<3>().cwiseMax(0).cwiseSqrt();
  result.reprojection_rms_px = refinement.reprojection_rms_px;
  result.corner_sigma_px = refinement.corner_sigma_px;
  result.arm_sigma = refinement.arm_sigma;
  result.ax_xb_all_pairs = ax_xb_residual_all_pairs(used_pairs, refinement.flange_T_camera);
  result.ax_xb_consecutive = ax_xb_residual_consecutive(used_pairs, refinement.flange_T_camera);
  result.board_in_base = board_in_base_residual(used_pairs, refinement.flange_T_camera);
  result.views = refinement.views_used;
  result.fits = refinement.views;
  result.reasons = {"not validated"};
  return result;
}

/// Views and their pose pairs that `fits` calls used (all that show a board when it is empty), the pairs settled among
/// the poses that each picture allows.
struct UsedViews {
  Indices given;
  std::vector<CalibrationView> views;
  std::vector<PosePair> pairs;
};

UsedViews select_views(const CameraIntrinsics& camera, const Targets& targets, std::span<const CalibrationView> views,
                       std::span<const ViewFit> fits,
                       const std::optional<Transform<Flange, Camera>>& flange_T_camera = {}) {
  UsedViews used;
  std::vector<OpenView> open;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i < fits.size() && !fits[i].used) continue;
    if (!targets.has(views[i].target)) continue;
    const auto pose = estimate_board_pose_robust(camera, targets[views[i].target], views[i].points());
    if (!pose) continue;
    used.given.push_back(i);
    used.views.push_back(views[i]);
    open.push_back(seen_one_way(views[i], pose->pose));
  }
  const auto choices = flange_T_camera ? settle_choices(open, *flange_T_camera) : settle_choices(open);
  for (std::size_t i = 0; i < open.size(); ++i) {
    used.pairs.push_back({open[i].base_T_flange, open[i].choices[choices[i]].camera_T_board, used.views[i].target,
                          used.views[i].station});
  }
  return used;
}

/// The same for several targets: a mistake is looked for in the views of each by itself, the first one found is named.
void name_mistake_of_targets(const CameraIntrinsics& camera, const Targets& targets,
                             std::span<const CalibrationView> views, const UsedViews& seen, HandEyeResult& result) {
  for (int k = 0; k < targets.size(); ++k) {
    std::vector<CalibrationView> own_views;
    HandEyeResult own;
    own.verdict = result.verdict;
    own.flange_T_camera = result.flange_T_camera;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (views[i].target != k) continue;
      own_views.push_back(views[i]);
      own.fits.push_back(result.fits[i]);
    }
    const std::vector<PosePair> own_pairs = pairs_of_target(seen.pairs, k);
    name_mistake(own_pairs, &targets[k], [&] { return find_likely_mistake(camera, targets[k], own_views); }, own);
    if (!own.likely_mistake) continue;
    own.likely_mistake->text = fmt::format("target {}: {}", k + 1, own.likely_mistake->text);
    result.likely_mistake = std::move(own.likely_mistake);
    if (result.verdict == Verdict::kRejected) result.reasons.push_back(result.likely_mistake->text);
    return;
  }
}

double squared_error_px(const CameraIntrinsics& camera, const BoardSpec& board, const CalibrationView& view,
                        const Transform<Flange, Camera>& flange_T_camera, const Transform<Base, Board>& base_T_board) {
  const auto camera_T_board = (view.base_T_flange * flange_T_camera).inverse() * base_T_board;
  constexpr double kNoImage_px = 1e4;
  double squared = 0;
  for (std::size_t i = 0; i < view.corners_px.size(); ++i) {
    const auto pixel = project(camera, camera_T_board * board.corner(point_of(view.ids, i)));
    squared += pixel ? (*pixel - view.corners_px[i]).squaredNorm() : kNoImage_px * kNoImage_px;
  }
  return squared;
}

}  // namespace

std::vector<std::string> covariance_reasons(const VerdictLimits& limits, const HandEyeResult& result) {
  std::vector<std::string> reasons;
  reject_above(
      {result.sigma_translation_m.maxCoeff(), limits.sigma_translation_max_m, 1e3, "sigma of translation", "mm"},
      reasons);
  if (!reasons.empty()) reasons.back() += weakest_direction(result.covariance.topLeftCorner<3, 3>());
  const std::size_t before = reasons.size();
  reject_above({result.sigma_rotation_rad.maxCoeff(), limits.sigma_rotation_max_rad, 1e3, "sigma of rotation", "mrad"},
               reasons);
  if (reasons.size() > before) reasons.back() += weakest_direction(result.covariance.bottomRightCorner<3, 3>());
  reject_above({3 * point_sigma(result.flange_T_camera, result.covariance, limits.mapping_distance_m),
                limits.voxel_size_m / 2, 1e3, "3 sigma at the mapping distance", "mm"},
               reasons);
  if (result.usable_distance_m < limits.usable_distance_min_m) {
    reasons.push_back(fmt::format("usable distance {:.2f} m for a tolerance of {:.0f} mm, least {:.2f} m",
                                  result.usable_distance_m, limits.tolerance_m * 1e3, limits.usable_distance_min_m));
  }
  return reasons;
}

double reprojection_rms(const CameraIntrinsics& camera, const BoardSpec& board, std::span<const CalibrationView> views,
                        const Transform<Flange, Camera>& flange_T_camera, const Transform<Base, Board>& base_T_board) {
  double squared = 0, corners = 0;
  for (const CalibrationView& view : views) {
    corners += static_cast<double>(view.corners_px.size());
    squared += squared_error_px(camera, board, view, flange_T_camera, base_T_board);
  }
  return corners == 0 ? 0 : std::sqrt(squared / (2 * corners));
}

Result<HandEyeResult> solve_hand_eye(const CameraIntrinsics& camera, const Targets& targets,
                                     std::span<const CalibrationView> views, const HandEyeOptions& options) {
  const UsedViews seen = select_views(camera, targets, views, {});
  const auto start = solve_pose_pairs_robust(seen.pairs, options.solver, options.refinement.view_gate);
  if (!start) return name_unobservable(start.error(), seen.pairs);
  const auto refinement = refine_hand_eye(camera, targets, views, start->flange_T_camera, options.refinement);
  if (!refinement) return name_unobservable(refinement.error(), seen.pairs);
  HandEyeResult result = start_result(
      *refinement,
      select_views(refinement->camera, targets, views, refinement->views, refinement->flange_T_camera).pairs);
  result.closed_form = start->flange_T_camera;
  result.closed_form_raw = start->raw_flange_T_camera;
  return result;
}

void validate_hand_eye(const CameraIntrinsics& given, const Targets& targets, std::span<const CalibrationView> views,
                       const HandEyeOptions& options, HandEyeResult& result, RunParallel run_parallel) {
  const CameraIntrinsics& camera = result.intrinsics ? result.camera : given;
  const UsedViews used = select_views(camera, targets, views, result.fits, result.flange_T_camera);
  const RefinementOptions quick = short_options(options, result);
  Validation validation;
  validation.pairs = used.pairs;
  validation.given = used.given;
  validation.views_given = views.size();
  for (int k = 0; k < targets.size(); ++k) validation.board_centers.push_back(targets[k].center());
  for (const CalibrationView& view : used.views) {
    validation.corners.push_back(static_cast<double>(view.corners_px.size()));
  }
  validation.resolve = [&](const Indices& indices) {
    std::vector<CalibrationView> some;
    for (const std::size_t i : indices) some.push_back(used.views[i]);
    return refine_hand_eye(camera, targets, some, result.flange_T_camera, quick);
  };
  validation.squared_px = [&](std::size_t i, const Refinement& r) {
    const auto target = static_cast<std::size_t>(used.views[i].target);
    return squared_error_px(r.camera, targets[used.views[i].target], used.views[i], r.flange_T_camera,
                            r.targets[target].base_T_board);
  };
  validate(validation, options, run_parallel, result);
  const UsedViews all = select_views(camera, targets, views, {}, result.flange_T_camera);
  if (targets.size() == 1) {
    name_mistake(all.pairs, &targets[0], [&] { return find_likely_mistake(camera, targets[0], views); }, result);
  } else {
    name_mistake_of_targets(camera, targets, views, all, result);
  }
  if (!result.likely_mistake && !result.intrinsics) name_wrong_intrinsics(given, targets, used.views, options, result);
}

Status test_hand_eye_by_touch(const Targets& targets, const TouchRecord& touched, std::span<const PosePair> used,
                              const TouchTestLimits& limits, HandEyeResult& result) {
  const auto target = static_cast<std::size_t>(touched.target);
  if (!targets.has(touched.target) || target >= result.targets.size() || result.targets[target].views == 0) {
    return failure(Fault::kTouchesUnusable, "no view that was used shows the board that was touched");
  }
  const BoardSpec& board = targets[touched.target];
  TouchOptions options;
  options.tip = touched.tip;
  options.arm_sigma = result.arm_sigma;
  auto located = locate_touched_board(board, touched.touches, options);
  if (!located) return std::unexpected(located.error());
  const TargetPose& calibrated = result.targets[target];
  result.touch_test = test_by_touch(board, std::move(*located),
                                    {result.flange_T_camera, calibrated.base_T_board, calibrated.covariance},
                                    pairs_of_target(used, touched.target), limits);
  for (const std::string& reason : result.touch_test->reasons) result.reasons.push_back(reason);
  if (!result.touch_test->agrees()) result.verdict = Verdict::kRejected;
  return {};
}

std::vector<PosePair> used_pairs(const CameraIntrinsics& camera, const Targets& targets,
                                 std::span<const CalibrationView> views, const HandEyeResult& result) {
  return select_views(camera, targets, views, result.fits, result.flange_T_camera).pairs;
}

std::vector<PosePair> used_pairs(std::span<const PosePair> pairs, const HandEyeResult& result) {
  std::vector<PosePair> used;
  for (std::size_t i = 0; i < pairs.size() && i < result.fits.size(); ++i) {
    if (result.fits[i].used) used.push_back(pairs[i]);
  }
  return used;
}

Result<HandEyeResult> calibrate_hand_eye(const CameraIntrinsics& camera, const Targets& targets,
                                         std::span<const CalibrationView> views, const HandEyeOptions& options) {
  auto result = solve_hand_eye(camera, targets, views, options);
  if (result) validate_hand_eye(camera, targets, views, options, *result);
  return result;
}

Result<HandEyeResult> calibrate_hand_eye_from_pairs(std::span<const PosePair> pairs, const HandEyeOptions& options) {
  if (target_count(pairs) > 1) {
    return failure(Fault::kDataMalformed, "pose pairs of {} targets; without corners only one is solved",
                   target_count(pairs));
  }
  const auto start = solve_pose_pairs_robust(pairs, options.solver, options.refinement.view_gate);
  if (!start) return name_unobservable(start.error(), pairs);
  const auto refinement = refine_from_pairs(pairs, start->flange_T_camera, options.refinement);
  if (!refinement) return name_unobservable(refinement.error(), pairs);
  Validation validation;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (refinement->views[i].used) validation.pairs.push_back(pairs[i]);
  }
  validation.board_centers.emplace_back(Eigen::Vector3d::Zero());
  HandEyeResult result = start_result(*refinement, validation.pairs);
  result.closed_form = start->flange_T_camera;
  result.closed_form_raw = start->raw_flange_T_camera;
  result.from_pairs = true;
  const RefinementOptions quick = short_options(options, result);
  validation.resolve = [&](const Indices& indices) {
    std::vector<PosePair> some;
    for (const std::size_t i : indices) some.push_back(validation.pairs[i]);
    return refine_from_pairs(some, result.flange_T_camera, quick);
  };
  validate(validation, options, run_serially, result);
  name_mistake(pairs, nullptr, [&] { return find_likely_mistake(pairs); }, result);
  return result;
}

}  // namespace firstlook
