/// Refinement from pose pairs: Gauss-Newton over hand-eye transform and board pose, the misfit of each view taken for a
/// deviation of the arm.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "algorithms/calibration/arm_sigma.hpp"
#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/calibration/hand_eye_refinement.hpp"
#include "algorithms/calibration/view_gate.hpp"

namespace firstlook {
namespace {

using Matrix6x12d = Eigen::Matrix<double, 6, 12>;

struct PairState {
  Pose flange_T_camera, base_T_board;
};

/// Misfit of the flange (seen minus said) and its derivative by further differences of hand-eye and board.
struct PairTerm {
  Vector6d misfit;
  Matrix6x12d jacobian;
};

PairTerm pair_term(const PosePair& pair, const PairState& state) {
  const Pose board_T_camera = pair.camera_T_board.pose().inverse(Eigen::Isometry);
  const Pose seen = state.base_T_board * board_T_camera * state.flange_T_camera.inverse(Eigen::Isometry);
  PairTerm term;
  term.misfit = pose_difference(seen, pair.base_T_flange.pose());
  const Eigen::Vector3d from_board = seen.translation() - state.base_T_board.translation();
  const Eigen::Matrix3d g = seen.linear();
  const Eigen::Matrix3d log_jacobian = left_jacobian(term.misfit.tail<3>()).inverse();
  term.jacobian.setZero();
  term.jacobian.block<3, 3>(0, 0) = -g;
  term.jacobian.block<3, 3>(0, 3) = -g * cross_matrix(state.flange_T_camera.translation());
  term.jacobian.block<3, 3>(0, 6).setIdentity();
  term.jacobian.block<3, 3>(0, 9) = -cross_matrix(from_board);
  term.jacobian.block<3, 3>(3, 3) = -log_jacobian * g;
  term.jacobian.block<3, 3>(3, 9) = log_jacobian;
  return term;
}

struct PairFit {
  PairState state;
  ArmSigma sigma;
  Matrix12d covariance = Matrix12d::Zero();
  std::vector<Vector6d> misfits;
};

/// Weighted Gauss-Newton with the sigmas updated after each step: their fixed point is the restricted maximum
/// likelihood.
Result<PairFit> fit_pairs(std::span<const PosePair> pairs, const Transform<Flange, Camera>& start,
                          const RefinementOptions& options) {
  if (pairs.size() < 3) return failure(Fault::kTooFewViews, "{} usable views, 3 are the least", pairs.size());
  const MotionDiversity diversity = motion_diversity(pairs);
  if (diversity.axes < 2) {
    return failure(Fault::kDegenerateMotion, "{} usable views turn about fewer than two axes", pairs.size());
  }
  PairFit fit{{start.pose(), median_board_pose(pairs, start).pose()}, {1e-3, 1e-3}, {}, {}};
  if (options.arm_sigma.translation_m > 0) fit.sigma.translation_m = options.arm_sigma.translation_m;
  if (options.arm_sigma.rotation_rad > 0) fit.sigma.rotation_rad = options.arm_sigma.rotation_rad;
  constexpr int kIterationsMax = 100;
  constexpr double kStepMin = 1e-13;
  double change = 1;
  for (int i = 0; i < kIterationsMax && change > kStepMin; ++i) {
    Matrix12d normal = Matrix12d::Zero();
    Vector12d right = Vector12d::Zero();
    std::vector<PairTerm> terms;
    Vector6d weight;
    weight << Eigen::Vector3d::Constant(std::pow(fit.sigma.translation_m, -2)),
        Eigen::Vector3d::Constant(std::pow(fit.sigma.rotation_rad, -2));
    for (const PosePair& pair : pairs) {
      terms.push_back(pair_term(pair, fit.state));
      const PairTerm& t = terms.back();
      normal += t.jacobian.transpose() * weight.asDiagonal() * t.jacobian;
      right -= t.jacobian.transpose() * weight.asDiagonal() * t.misfit;
    }
    const Eigen::LDLT<Matrix12d> ldlt(normal);
    fit.covariance = ldlt.solve(Matrix12d::Identity());
    const Vector12d step = ldlt.solve(right);
    if (!step.allFinite() || !fit.covariance.allFinite()) {
      return failure(Fault::kSolveFailed, "the least squares over poses did not converge");
    }
    fit.state.flange_T_camera = perturb(fit.state.flange_T_camera, step.head<6>());
    fit.state.base_T_board = perturb(fit.state.base_T_board, step.tail<6>());
    fit.misfits.clear();
    std::vector<Matrix6d> spreads;
    for (const PairTerm& t : terms) {
      fit.misfits.push_back(t.misfit + t.jacobian * step);
      spreads.push_back(t.jacobian * fit.covariance * t.jacobian.transpose());
    }
    const ArmSigma next = next_arm_sigma(fit.misfits, spreads, options);
    change = step.norm() + std::abs(next.translation_m / fit.sigma.translation_m - 1) * 1e-6 +
             std::abs(next.rotation_rad / fit.sigma.rotation_rad - 1) * 1e-6;
    fit.sigma = next;
  }
  return fit;
}

std::vector<std::size_t> indices_kept(std::span<const PosePair> pairs, const Transform<Flange, Camera>& hand_eye,
                                      double gate) {
  const std::vector<bool> keep = gate_views(pairs, hand_eye, gate);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (keep[i]) kept.push_back(i);
  }
  return kept;
}

Refinement report(const PairFit& fit, std::span<const std::size_t> used, std::size_t given) {
  Refinement result;
  result.flange_T_camera = Transform<Flange, Camera>(fit.state.flange_T_camera);
  result.base_T_board = Transform<Base, Board>(fit.state.base_T_board);
  result.covariance = fit.covariance.topLeftCorner<6, 6>();
  result.board_covariance = fit.covariance.bottomRightCorner<6, 6>();
  result.joint_covariance = fit.covariance;
  result.targets = {{static_cast<int>(used.size()), result.base_T_board, result.board_covariance}};
  result.arm_sigma = fit.sigma;
  result.views.resize(given);
  for (ViewFit& view : result.views) view.used = false;
  for (std::size_t i = 0; i < used.size(); ++i) {
    result.views[used[i]].used = true;
    result.views[used[i]].arm_deviation = fit.misfits[i];
  }
  result.views_used = static_cast<int>(used.size());
  return result;
}

}  // namespace

Result<Refinement> refine_from_pairs(std::span<const PosePair> pairs, const Transform<Flange, Camera>& start,
                                     const RefinementOptions& options) {
  if (pairs.size() < 3) return failure(Fault::kTooFewViews, "{} views, 3 are the least", pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!pairs[i].base_T_flange.pose().matrix().allFinite() || !pairs[i].camera_T_board.pose().matrix().allFinite()) {
      return failure(Fault::kDataMalformed, "view {}: a pose is not finite", i + 1);
    }
  }
  if (!start.pose().matrix().allFinite()) return failure(Fault::kDataMalformed, "the start is not finite");
  auto hand_eye = start;
  std::vector<std::size_t> used = indices_kept(pairs, hand_eye, options.view_gate);
  constexpr int kGatingsMax = 3;
  for (int gating = 1;; ++gating) {
    std::vector<PosePair> kept;
    for (const std::size_t i : used) kept.push_back(pairs[i]);
    const auto fit = fit_pairs(kept, hand_eye, options);
    if (!fit) return std::unexpected(fit.error());
    hand_eye = Transform<Flange, Camera>(fit->state.flange_T_camera);
    std::vector<std::size_t> again = indices_kept(pairs, hand_eye, options.view_gate);
    if (gating == kGatingsMax || again == used) return report(*fit, used, pairs.size());
    used = std::move(again);
  }
}

}  // namespace firstlook
