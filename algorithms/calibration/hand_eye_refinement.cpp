#include "algorithms/calibration/hand_eye_refinement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
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

/// One place of the arm has one pose, and shows a target once.
Status check_stations(std::span<const CalibrationView> views) {
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t j = 0; j < i && views[i].station >= 0; ++j) {
      if (views[j].station != views[i].station) continue;
      if (views[j].target == views[i].target ||
          views[j].base_T_flange.pose().matrix() != views[i].base_T_flange.pose().matrix()) {
        return failure(Fault::kDataMalformed,
                       "views {} and {}: one station, but another pose of the arm or the same target", j + 1, i + 1);
      }
    }
  }
  return {};
}

Status check_input(const CameraIntrinsics& camera, const Targets& targets, std::span<const CalibrationView> views,
                   const Transform<Flange, Camera>& start) {
  for (int k = 0; k < targets.size(); ++k) {
    if (const Status fine = check_board(targets[k]); !fine) return fine;
  }
  if (!is_usable(camera)) return failure(Fault::kDataMalformed, "camera intrinsics are not usable");
  if (!start.pose().matrix().allFinite()) return failure(Fault::kDataMalformed, "the start is not finite");
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!views[i].base_T_flange.pose().matrix().allFinite()) {
      return failure(Fault::kDataMalformed, "view {}: the arm's pose is not finite", i + 1);
    }
    if (!targets.has(views[i].target)) {
      return failure(Fault::kDataMalformed, "view {}: target {} of {}", i + 1, views[i].target, targets.size());
    }
    if (const Status fine = check_points(targets[views[i].target], views[i].points()); !fine) {
      return failure(Fault::kDataMalformed, "view {}: {}", i + 1, fine.error().detail());
    }
  }
  return check_stations(views);
}

/// Corners are weighed against the view's own board pose, where neither the arm nor other views can mislead; which of
/// two poses that is, when a picture allows both, the views settle under the start.
std::vector<PreparedView> prepare(const CameraIntrinsics& camera, const Targets& targets,
                                  std::span<const CalibrationView> views, const Transform<Flange, Camera>& start,
                                  const RefinementOptions& options) {
  std::vector<PreparedView> prepared;
  std::vector<OpenView> open;
  for (std::size_t i = 0; i < views.size(); ++i) {
    auto seen = estimate_board_pose_robust(camera, targets[views[i].target], views[i].points(), kBoardResidualMax_px,
                                           options.corner_loss_scale, options.corner_sigma_min_px);
    if (!seen) continue;
    open.push_back(seen_one_way(views[i], seen->pose));
    prepared.push_back({i,
                        {views[i].base_T_flange, seen->pose.camera_T_board, views[i].target, views[i].station},
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
  const auto misfits = flange_misfits(pairs, flange_T_camera, median_board_poses(pairs, flange_T_camera));
  const std::vector<Matrix6d> exact(misfits.size(), Matrix6d::Zero());
  return next_arm_sigma(misfits, exact, options);
}

/// The unknowns of a solve: the boards that its views show, and the places of the arm they were taken from.
struct Layout {
  std::vector<int> targets;  ///< of each board of the bundle
  std::vector<BoardSpec> boards;
  std::vector<std::size_t> board;    ///< of each view
  std::vector<std::size_t> station;  ///< of each view
  std::size_t stations = 0;
};

Layout layout_of(const Targets& targets, std::span<const PosePair> pairs) {
  Layout layout;
  std::vector<std::size_t> number(static_cast<std::size_t>(targets.size()));
  for (int k = 0; k < targets.size(); ++k) {
    number[static_cast<std::size_t>(k)] = layout.targets.size();
    if (pairs_of_target(pairs, k).empty()) continue;
    layout.targets.push_back(k);
    layout.boards.push_back(targets[k]);
  }
  for (const PosePair& pair : pairs) layout.board.push_back(number[static_cast<std::size_t>(pair.target)]);
  layout.station = stations_of(pairs);
  layout.stations = station_count(layout.station);
  return layout;
}

struct Fit {
  Layout layout;
  IntrinsicsBelief intrinsics;
  BundleState state;
  BundleNoise noise;
  LinearSolution linear;
  LinearizedBundle bundle;
};

/// The normal equations of all stations, as solve_linear and estimate_arm_sigma take them when there are several boards
/// or intrinsics to solve for.
std::vector<StationNormal> station_normals(const Fit& fit) {
  const int intrinsics = fit.intrinsics.count;
  std::vector<StationNormal> stations(fit.layout.stations,
                                      StationNormal(static_cast<int>(fit.layout.boards.size()), intrinsics));
  for (std::size_t i = 0; i < fit.bundle.views.size(); ++i) {
    StationNormal& station = stations[fit.layout.station[i]];
    station.add(fit.bundle.views[i], fit.layout.board[i]);
    if (intrinsics > 0) station.add(fit.bundle.intrinsics[i], fit.layout.board[i], intrinsics);
  }
  return stations;
}

/// What is believed of the intrinsics, as rows of the normal equations.
GlobalPrior prior_of(const Fit& fit) {
  const Eigen::Index count = fit.intrinsics.count;
  if (count == 0) return {};
  GlobalPrior prior;
  prior.weight.setZero(6 + 6 * static_cast<Eigen::Index>(fit.layout.boards.size()) + count);
  prior.right = prior.weight;
  prior.weight.tail(count) = fit.intrinsics.weight.head(count);
  prior.right.tail(count) = fit.intrinsics.right(fit.state.camera).head(count);
  return prior;
}

/// One board and a known camera have equations of fixed size, whose matrices take nothing from the heap.
bool has_fixed_size(const Fit& fit) { return fit.layout.boards.size() == 1 && fit.intrinsics.count == 0; }

std::optional<LinearSolution> solve_linear_of(const Fit& fit, const ArmSigma& sigma) {
  if (has_fixed_size(fit)) return solve_linear(fit.bundle.views, fit.state.deviations, sigma);
  return solve_linear(station_normals(fit), fit.state.deviations, sigma, prior_of(fit));
}

std::optional<ArmSigma> arm_sigma_of(const Fit& fit, const ArmSigma& start, const RefinementOptions& options) {
  if (has_fixed_size(fit)) return estimate_arm_sigma(fit.bundle.views, fit.state.deviations, start, options);
  return estimate_arm_sigma(station_normals(fit), fit.state.deviations, start, options, prior_of(fit));
}

/// What an estimated sigma must be taken for in a covariance: with v degrees of freedom its square is uncertain, and
/// the errors scatter by v / (v - 2) more than it says (Student 1908). Three for each station, less half of the
/// unknowns of hand-eye and boards.
ArmSigma as_unsure(ArmSigma sigma, const Layout& layout, const RefinementOptions& options) {
  const double unknowns = 6 + 6 * static_cast<double>(layout.boards.size());
  const double freedom = std::max(3.0, 3 * static_cast<double>(layout.stations) - unknowns / 2);
  const double factor = std::sqrt(freedom / (freedom - 2));
  if (options.arm_sigma.translation_m <= 0) sigma.translation_m *= factor;
  if (options.arm_sigma.rotation_rad <= 0) sigma.rotation_rad *= factor;
  return sigma;
}

IntrinsicsFit intrinsics_of(const Fit& fit) {
  const Eigen::Index count = fit.intrinsics.count;
  IntrinsicsFit intrinsics;
  intrinsics.count = fit.intrinsics.count;
  intrinsics.covariance.topLeftCorner(count, count) = fit.linear.covariance.bottomRightCorner(count, count);
  intrinsics.untold = untold_distortion(fit.intrinsics, intrinsics.sigma());
  return intrinsics;
}

/// Singular normal equations: the camera's fault when they are not without its intrinsics, else the motion's.
std::unexpected<Error> undetermined(const Fit& fit) {
  Fit known = fit;
  known.intrinsics = {};
  if (fit.intrinsics.count > 0 && solve_linear_of(known, fit.noise.arm_sigma)) {
    return failure(Fault::kIntrinsicsUnknown, "{} views leave focal lengths and centre open", fit.bundle.views.size());
  }
  return failure(Fault::kDegenerateMotion, "the views leave a direction undetermined");
}

/// Rounds of solving and estimating the sigmas, until these settle.
Result<Fit> fit_bundle(std::span<const BundleView> views, Fit fit, const RefinementOptions& options) {
  constexpr double kSettled = 0.003;  // relative change of a sigma
  for (int round = 0; round < options.rounds_max; ++round) {
    const Status solved =
        solve_bundle(fit.layout.boards, views, fit.noise, fit.intrinsics, options.iterations_max, fit.state);
    if (!solved) return std::unexpected(solved.error());
    auto bundle =
        linearize_bundle(fit.layout.boards, views, fit.noise.corner_sigma_px, fit.intrinsics.count > 0, fit.state);
    if (!bundle) return std::unexpected(bundle.error());
    fit.bundle = std::move(*bundle);
    const BundleNoise before = fit.noise;
    const bool last = round + 1 == options.rounds_max;
    if (!last) {
      const auto arm = arm_sigma_of(fit, before.arm_sigma, options);
      if (!arm) return undetermined(fit);
      fit.noise.arm_sigma = *arm;
    }
    const auto linear = solve_linear_of(fit, fit.noise.arm_sigma);
    if (!linear) return undetermined(fit);
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
  const auto unsure = solve_linear_of(fit, as_unsure(fit.noise.arm_sigma, fit.layout, options));
  if (unsure) fit.linear.covariance = unsure->covariance;
  if (fit.intrinsics.count == 0) return fit;
  const std::string open = undetermined_intrinsics(fit.state.camera, intrinsics_of(fit).sigma());
  if (!open.empty()) return failure(Fault::kIntrinsicsUnknown, "{} views do not tell {}", views.size(), open);
  return fit;
}

Result<Fit> fit_views(const CameraIntrinsics& camera, const Targets& targets, std::span<const CalibrationView> given,
                      std::span<const PreparedView> used, const Transform<Flange, Camera>& start,
                      const RefinementOptions& options) {
  const std::vector<PosePair> pairs = pairs_of(used);
  if (pairs.size() < 3) return failure(Fault::kTooFewViews, "{} usable views, 3 are the least", pairs.size());
  const MotionDiversity diversity = motion_diversity(pairs);
  if (diversity.axes < 2) {
    return failure(Fault::kDegenerateMotion, "{} usable views turn about fewer than two axes", pairs.size());
  }
  Fit fit;
  fit.layout = layout_of(targets, pairs);
  fit.intrinsics = belief_of(options.intrinsics, options.intrinsics_prior);
  fit.state.camera = camera;
  std::vector<BundleView> views;
  for (std::size_t i = 0; i < used.size(); ++i) {
    views.push_back({used[i].pair.base_T_flange.pose(), given[used[i].index].points(), used[i].weights,
                     fit.layout.board[i], fit.layout.station[i]});
  }
  fit.state.flange_T_camera = start.pose();
  const auto poses = median_board_poses(pairs, start);
  for (const int k : fit.layout.targets) fit.state.base_T_board.push_back(poses[static_cast<std::size_t>(k)].pose());
  fit.state.deviations.assign(fit.layout.stations, Vector6d::Zero());
  fit.noise.corner_sigma_px = options.corner_sigma_px > 0
                                  ? options.corner_sigma_px
                                  : std::max(options.corner_sigma_min_px, robust_corner_sigma(used));
  fit.noise.arm_sigma = rough_arm_sigma(pairs, start, options);
  return fit_bundle(views, std::move(fit), options);
}

/// Poses of the boards with what the linear solution says of them.
void report_targets(const Fit& fit, int targets, Refinement& result) {
  result.targets.resize(static_cast<std::size_t>(targets));
  for (std::size_t b = 0; b < fit.layout.targets.size(); ++b) {
    TargetPose& target = result.targets[static_cast<std::size_t>(fit.layout.targets[b])];
    const auto at = 6 + 6 * static_cast<Eigen::Index>(b);
    target.base_T_board = Transform<Base, Board>(fit.state.base_T_board[b]);
    target.covariance = fit.linear.covariance.block<6, 6>(at, at);
    target.views = static_cast<int>(std::count(fit.layout.board.begin(), fit.layout.board.end(), b));
  }
  result.joint_covariance = fit.linear.covariance;
}

Refinement report(const Fit& fit, std::span<const PreparedView> used, int targets, std::size_t given) {
  Refinement result;
  result.camera = fit.state.camera;
  if (fit.intrinsics.count > 0) result.intrinsics = intrinsics_of(fit);
  result.flange_T_camera = Transform<Flange, Camera>(fit.state.flange_T_camera);
  result.base_T_board = Transform<Base, Board>(fit.state.base_T_board.front());
  result.covariance = fit.linear.covariance.topLeftCorner<6, 6>();
  result.board_covariance = fit.linear.covariance.block<6, 6>(6, 6);
  report_targets(fit, targets, result);
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
    view.arm_deviation = fit.state.deviations[fit.layout.station[i]];
    squared += fit.bundle.squared_px[i];
    weights += own_weights;
  }
  result.reprojection_rms_px = std::sqrt(squared / std::max(1.0, weights));
  result.views_used = static_cast<int>(fit.layout.stations);
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

/// True when the corners were weighed under a camera that is further from the solution than the views tell.
bool camera_moved(const CameraIntrinsics& weighed_with, const Fit& fit) {
  if (fit.intrinsics.count == 0) return false;
  const Eigen::Index count = fit.intrinsics.count;
  const Eigen::VectorXd step =
      (intrinsics_vector(fit.state.camera) - intrinsics_vector(weighed_with)).head(count).eval();
  const Eigen::MatrixXd covariance = fit.linear.covariance.bottomRightCorner(count, count);
  return step.dot(covariance.ldlt().solve(step)) > static_cast<double>(count);
}

bool same_views(std::span<const PreparedView> a, std::span<const PreparedView> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const PreparedView& x, const PreparedView& y) { return x.index == y.index; });
}

}  // namespace

std::optional<MutualPose> mutual_pose(std::span<const TargetPose> targets, const Eigen::MatrixXd& joint_covariance,
                                      int from, int to) {
  const auto place = [&](int target) {
    Eigen::Index at = 6;
    for (int k = 0; k < target; ++k) at += targets[static_cast<std::size_t>(k)].views > 0 ? 6 : 0;
    return at;
  };
  const TargetPose &a = targets[static_cast<std::size_t>(from)], &b = targets[static_cast<std::size_t>(to)];
  if (a.views == 0 || b.views == 0) return std::nullopt;
  // With errors d_t, d_r of both in base: t = R_a^T (t_b - t_a), R = R_a^T R_b, each to first order.
  const Eigen::Matrix3d turned = a.base_T_board.rotation().transpose();
  const Eigen::Vector3d between = b.base_T_board.translation() - a.base_T_board.translation();
  Eigen::Matrix<double, 6, 12> jacobian = Eigen::Matrix<double, 6, 12>::Zero();
  jacobian.block<3, 3>(0, 0) = -turned;
  jacobian.block<3, 3>(0, 3) = turned * cross_matrix(between);
  jacobian.block<3, 3>(3, 3) = -turned;
  jacobian.block<3, 3>(0, 6) = turned;
  jacobian.block<3, 3>(3, 9) = turned;
  const std::array<Eigen::Index, 2> at = {place(from), place(to)};
  Matrix12d both;
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      both.block<6, 6>(6 * static_cast<Eigen::Index>(i), 6 * static_cast<Eigen::Index>(j)) =
          joint_covariance.block<6, 6>(at[i], at[j]);
    }
  }
  return MutualPose{a.base_T_board.inverse() * b.base_T_board, jacobian * both * jacobian.transpose()};
}

Result<Refinement> refine_hand_eye(const CameraIntrinsics& camera, const Targets& targets,
                                   std::span<const CalibrationView> views, const Transform<Flange, Camera>& start,
                                   const RefinementOptions& options) {
  if (const Status fine = check_input(camera, targets, views, start); !fine) return std::unexpected(fine.error());
  CameraIntrinsics camera_now = camera;
  std::vector<PreparedView> prepared = prepare(camera, targets, views, start, options);
  if (prepared.size() < 3) {
    return failure(Fault::kTooFewViews, "{} of {} views show the board, 3 are the least", prepared.size(),
                   views.size());
  }
  // Views are gated with the start's transform, then once more with the better one that came of it. Another camera
  // weighs the corners anew, too.
  auto hand_eye = start;
  std::vector<PreparedView> used = without_gated(prepared, hand_eye, options.view_gate);
  constexpr int kGatingsMax = 3;
  for (int gating = 1;; ++gating) {
    const auto fit = fit_views(camera_now, targets, views, used, hand_eye, options);
    if (!fit) return std::unexpected(fit.error());
    hand_eye = Transform<Flange, Camera>(fit->state.flange_T_camera);
    const bool moved = camera_moved(camera_now, *fit);
    camera_now = fit->state.camera;
    if (moved) prepared = prepare(camera_now, targets, views, hand_eye, options);
    std::vector<PreparedView> again = without_gated(prepared, hand_eye, options.view_gate);
    if (gating == kGatingsMax || (!moved && same_views(again, used))) {
      return report(*fit, used, targets.size(), views.size());
    }
    used = std::move(again);
  }
}

}  // namespace firstlook
