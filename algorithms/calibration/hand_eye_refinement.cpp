#include "algorithms/calibration/hand_eye_refinement.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/calibration/arm_sigma.hpp"
#include "algorithms/calibration/board_ambiguity.hpp"
#include "algorithms/calibration/bundle.hpp"
#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/calibration/view_gate.hpp"
#include "algorithms/vision/board_pose.hpp"
#include "algorithms/vision/camera_model.hpp"

namespace firstlook {
namespace {

/// A view whose corners miss every board pose by more than this is not a picture of the board.
constexpr double kBoardResidualMax_px = 5;

/// A view with what its own board pose says about it.
struct PreparedView {
  std::size_t index = 0;  ///< among the views given
  PosePair pair;
  std::vector<double> residuals_px;  ///< length of each corner's error against the view's own board pose
  std::vector<double> weights;
};

Status check_input(const CameraIntrinsics& camera, const BoardSpec& board, std::span<const CalibrationView> views,
                   const Transform<Flange, Camera>& start) {
  if (const Status fine = check_board(board); !fine) return fine;
  if (!is_usable(camera)) return failure(Fault::kDataMalformed, "camera intrinsics are not usable");
  if (!start.pose().matrix().allFinite()) return failure(Fault::kDataMalformed, "the start is not finite");
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!views[i].base_T_flange.pose().matrix().allFinite()) {
      return failure(Fault::kDataMalformed, "view {}: the arm's pose is not finite", i + 1);
    }
    if (const Status fine = check_points(board, views[i].points()); !fine) {
      return failure(Fault::kDataMalformed, "view {}: {}", i + 1, fine.error().detail());
    }
  }
  return {};
}

/// Corners are weighed against the view's own board pose, where neither the arm nor other views can mislead; which of
/// two poses that is, when a picture allows both, the views settle under the start.
std::vector<PreparedView> prepare(const CameraIntrinsics& camera, const BoardSpec& board,
                                  std::span<const CalibrationView> views, const Transform<Flange, Camera>& start,
                                  const RefinementOptions& options) {
  std::vector<PreparedView> prepared;
  std::vector<OpenView> open;
  for (std::size_t i = 0; i < views.size(); ++i) {
    auto seen = estimate_board_pose_robust(camera, board, views[i].points(), kBoardResidualMax_px,
                                           options.corner_loss_scale, options.corner_sigma_min_px);
    if (!seen) continue;
    open.push_back(seen_one_way(views[i], seen->pose));
    prepared.push_back({i,
                        {views[i].base_T_flange, seen->pose.camera_T_board},
                        std::move(seen->residuals_px),
                        std::move(seen->weights)});
  }
  const auto choices = settle_choices(open, start);
  for (std::size_t i = 0; i < open.size(); ++i) {
    prepared[i].pair.camera_T_board = open[i].choices[choices[i]].camera_T_board;
  }
  return prepared;
}

/// Sigma of a corner coordinate from all residual lengths: for a Rayleigh distribution the median is 1.1774 sigma.
double robust_corner_sigma(std::span<const PreparedView> views) {
  std::vector<double> lengths;
  for (const PreparedView& view : views) {
    lengths.insert(lengths.end(), view.residuals_px.begin(), view.residuals_px.end());
  }
  if (lengths.empty()) return 0;
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle / 1.1774;
}

std::vector<PosePair> pairs_of(std::span<const PreparedView> views) {
  std::vector<PosePair> pairs;
  for (const PreparedView& view : views) pairs.push_back(view.pair);
  return pairs;
}

/// A start for the arm's sigmas, too large rather than too small: what the views' poses disagree by.
ArmSigma rough_arm_sigma(std::span<const PosePair> pairs, const Transform<Flange, Camera>& flange_T_camera,
                         const RefinementOptions& options) {
  const auto misfits = flange_misfits(pairs, flange_T_camera, median_board_pose(pairs, flange_T_camera));
  const std::vector<Matrix6d> exact(misfits.size(), Matrix6d::Zero());
  return next_arm_sigma(misfits, exact, options);
}

struct Fit {
  BundleState state;
  BundleNoise noise;
  LinearSolution linear;
  LinearizedBundle bundle;
};

/// What an estimated sigma must be taken for in a covariance: with v degrees of freedom its square is uncertain, and
/// the errors scatter by v / (v - 2) more than it says (Student 1908). Three for each view, less half of the twelve
/// unknowns.
ArmSigma as_unsure(ArmSigma sigma, std::size_t views, const RefinementOptions& options) {
  const double freedom = std::max(3.0, 3 * static_cast<double>(views) - 6);
  const double factor = std::sqrt(freedom / (freedom - 2));
  if (options.arm_sigma.translation_m <= 0) sigma.translation_m *= factor;
  if (options.arm_sigma.rotation_rad <= 0) sigma.rotation_rad *= factor;
  return sigma;
}

/// Rounds of solving and estimating the sigmas, until these settle.
Result<Fit> fit_bundle(const CameraIntrinsics& camera, const BoardSpec& board, std::span<const BundleView> views,
                       Fit fit, const RefinementOptions& options) {
  constexpr double kSettled = 0.003;  // relative change of a sigma
  for (int round = 0; round < options.rounds_max; ++round) {
    const Status solved = solve_bundle(camera, board, views, fit.noise, options.iterations_max, fit.state);
    if (!solved) return std::unexpected(solved.error());
    auto bundle = linearize_bundle(camera, board, views, fit.noise.corner_sigma_px, fit.state);
    if (!bundle) return std::unexpected(bundle.error());
    fit.bundle = std::move(*bundle);
    const BundleNoise before = fit.noise;
    const bool last = round + 1 == options.rounds_max;
    if (!last) {
      const auto arm = estimate_arm_sigma(fit.bundle.views, fit.state.deviations, before.arm_sigma, options);
      if (!arm) return failure(Fault::kDegenerateMotion, "the views leave a direction undetermined");
      fit.noise.arm_sigma = *arm;
    }
    const auto linear = solve_linear(fit.bundle.views, fit.state.deviations, fit.noise.arm_sigma);
    if (!linear) return failure(Fault::kDegenerateMotion, "the views leave a direction undetermined");
    fit.linear = *linear;
    if (last) break;
    if (options.corner_sigma_px <= 0) {
      double squared = 0;
      for (const double s : fit.bundle.squared_px) squared += s;
      const double freedom = std::max(1.0, fit.bundle.weighted_coordinates - linear->effective_parameters);
      fit.noise.corner_sigma_px = std::max(options.corner_sigma_min_px, std::sqrt(squared / freedom));
    }
    const double change = std::max({std::abs(fit.noise.corner_sigma_px / before.corner_sigma_px - 1),
                                    std::abs(fit.noise.arm_sigma.translation_m / before.arm_sigma.translation_m - 1),
                                    std::abs(fit.noise.arm_sigma.rotation_rad / before.arm_sigma.rotation_rad - 1)});
    if (change < kSettled) break;
  }
  const auto unsure =
      solve_linear(fit.bundle.views, fit.state.deviations, as_unsure(fit.noise.arm_sigma, views.size(), options));
  if (unsure) fit.linear.covariance = unsure->covariance;
  return fit;
}

Result<Fit> fit_views(const CameraIntrinsics& camera, const BoardSpec& board, std::span<const CalibrationView> given,
                      std::span<const PreparedView> used, const Transform<Flange, Camera>& start,
                      const RefinementOptions& options) {
  const std::vector<PosePair> pairs = pairs_of(used);
  if (pairs.size() < 3) return failure(Fault::kTooFewViews, "{} usable views, 3 are the least", pairs.size());
  const MotionDiversity diversity = motion_diversity(pairs);
  if (diversity.axes < 2) {
    return failure(Fault::kDegenerateMotion, "{} usable views turn about fewer than two axes", pairs.size());
  }
  std::vector<BundleView> views;
  for (const PreparedView& view : used) {
    views.push_back({view.pair.base_T_flange.pose(), given[view.index].points(), view.weights});
  }
  Fit fit;
  fit.state.flange_T_camera = start.pose();
  fit.state.base_T_board = median_board_pose(pairs, start).pose();
  fit.state.deviations.assign(views.size(), Vector6d::Zero());
  fit.noise.corner_sigma_px = options.corner_sigma_px > 0
                                  ? options.corner_sigma_px
                                  : std::max(options.corner_sigma_min_px, robust_corner_sigma(used));
  fit.noise.arm_sigma = rough_arm_sigma(pairs, start, options);
  return fit_bundle(camera, board, views, std::move(fit), options);
}

Refinement report(const Fit& fit, std::span<const PreparedView> used, std::size_t given) {
  Refinement result;
  result.flange_T_camera = Transform<Flange, Camera>(fit.state.flange_T_camera);
  result.base_T_board = Transform<Base, Board>(fit.state.base_T_board);
  result.covariance = fit.linear.covariance.topLeftCorner<6, 6>();
  result.board_covariance = fit.linear.covariance.bottomRightCorner<6, 6>();
  result.corner_sigma_px = fit.noise.corner_sigma_px;
  result.arm_sigma = fit.noise.arm_sigma;
  result.views.resize(given);
  for (ViewFit& view : result.views) view.used = false;
  double squared = 0, weights = 0;
  for (std::size_t i = 0; i < used.size(); ++i) {
    double own_weights = 0;
    for (const double w : used[i].weights) own_weights += 2 * w;
    ViewFit& view = result.views[used[i].index];
    view.used = true;
    view.reprojection_rms_px = std::sqrt(fit.bundle.squared_px[i] / std::max(1.0, own_weights));
    view.arm_deviation = fit.state.deviations[i];
    squared += fit.bundle.squared_px[i];
    weights += own_weights;
  }
  result.reprojection_rms_px = std::sqrt(squared / std::max(1.0, weights));
  result.views_used = static_cast<int>(used.size());
  return result;
}

std::vector<PreparedView> without_gated(std::span<const PreparedView> views, const Transform<Flange, Camera>& hand_eye,
                                        double gate) {
  const std::vector<bool> keep = gate_views(pairs_of(views), hand_eye, gate);
  std::vector<PreparedView> kept;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (keep[i]) kept.push_back(views[i]);
  }
  return kept;
}

bool same_views(std::span<const PreparedView> a, std::span<const PreparedView> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const PreparedView& x, const PreparedView& y) { return x.index == y.index; });
}

}  // namespace

Result<Refinement> refine_hand_eye(const CameraIntrinsics& camera, const BoardSpec& board,
                                   std::span<const CalibrationView> views, const Transform<Flange, Camera>& start,
                                   const RefinementOptions& options) {
  if (const Status fine = check_input(camera, board, views, start); !fine) return std::unexpected(fine.error());
  std::vector<PreparedView> prepared = prepare(camera, board, views, start, options);
  if (prepared.size() < 3) {
    return failure(Fault::kTooFewViews, "{} of {} views show the board, 3 are the least", prepared.size(),
                   views.size());
  }
  // Views are gated with the start's transform, then once more with the better one that came of it.
  auto hand_eye = start;
  std::vector<PreparedView> used = without_gated(prepared, hand_eye, options.view_gate);
  constexpr int kGatingsMax = 3;
  for (int gating = 1;; ++gating) {
    const auto fit = fit_views(camera, board, views, used, hand_eye, options);
    if (!fit) return std::unexpected(fit.error());
    hand_eye = Transform<Flange, Camera>(fit->state.flange_T_camera);
    std::vector<PreparedView> again = without_gated(prepared, hand_eye, options.view_gate);
    if (gating == kGatingsMax || same_views(again, used)) return report(*fit, used, views.size());
    used = std::move(again);
  }
}

}  // namespace firstlook
