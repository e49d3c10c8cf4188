/// How far the arm's word about its flange is from the truth, estimated together with everything else.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "algorithms/calibration/hand_eye_refinement.hpp"
#include "algorithms/calibration/reprojection_terms.hpp"

namespace firstlook {

/// Normal equations of one place of the arm over hand-eye, several boards and intrinsics = "global", and the arm's
/// deviation there; the views that were taken from it added up.
struct StationNormal {
  static constexpr int kGlobal = Eigen::Dynamic;
  Eigen::MatrixXd global;  ///< 6 rows for the hand-eye, then 6 for each board, then one for each intrinsic
  Eigen::Matrix<double, Eigen::Dynamic, 6> global_arm;
  Matrix6d arm = Matrix6d::Zero();
  Eigen::VectorXd global_right;
  Vector6d arm_right = Vector6d::Zero();

  explicit StationNormal(int boards, int intrinsics = 0);
  /// @param board  which one the view shows
  void add(const ViewNormal& view, std::size_t board);
  /// What the same view says of the first `count` intrinsics.
  void add(const IntrinsicsNormal& view, std::size_t board, int count);
};

/// What is known of hand-eye, boards and intrinsics beside the views: weights (1 / sigma^2) and their pull, one for
/// each row of StationNormal::global; empty: nothing.
struct GlobalPrior {
  Eigen::VectorXd weight, right;
};

/// Solution of the linearised problem for given sigmas.
struct LinearSolution {
  Eigen::MatrixXd covariance;                  ///< of (hand-eye, boards, intrinsics), deviations marginalised
  std::vector<Matrix6d> deviation_covariance;  ///< one for each station
  std::vector<Vector6d> deviations;            ///< in total, not the step
  double effective_parameters = 0;             ///< trace of the hat matrix over the corner residuals
};

/// Solves the normal equations of all views (weights: 1 / corner variance) with a Gaussian prior of `sigma` on the arm
/// deviations, which stand at `deviations` where the views are linearised. Empty when they are singular.
/// One board and a station for each view, or several boards.
[[nodiscard]] std::optional<LinearSolution> solve_linear(std::span<const ViewNormal> views,
                                                         std::span<const Vector6d> deviations, const ArmSigma& sigma);
[[nodiscard]] std::optional<LinearSolution> solve_linear(std::span<const StationNormal> stations,
                                                         std::span<const Vector6d> deviations, const ArmSigma& sigma,
                                                         const GlobalPrior& prior = {});

/// Expectation maximisation (Dempster, Laird and Rubin 1977) over the linearised problem: the expected squares of the
/// deviations give the next sigmas. Sigmas that `options` states stay; none falls below its lower bound. Empty when the
/// normal equations are singular.
[[nodiscard]] std::optional<ArmSigma> estimate_arm_sigma(std::span<const ViewNormal> views,
                                                         std::span<const Vector6d> deviations, ArmSigma start,
                                                         const RefinementOptions& options);
[[nodiscard]] std::optional<ArmSigma> estimate_arm_sigma(std::span<const StationNormal> stations,
                                                         std::span<const Vector6d> deviations, ArmSigma start,
                                                         const RefinementOptions& options,
                                                         const GlobalPrior& prior = {});

/// The next sigmas from deviations and their covariances, by the rule above.
[[nodiscard]] ArmSigma next_arm_sigma(std::span<const Vector6d> deviations, std::span<const Matrix6d> covariances,
                                      const RefinementOptions& options);

}  // namespace firstlook
