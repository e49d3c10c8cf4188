/// The adapter to Ceres: its types and exceptions end here. Everything that its CHECKs could trip over (numbers that
/// are not finite, empty blocks) is refused before it is called.
#include "algorithms/calibration/bundle.hpp"

#include <ceres/ceres.h>

#include <array>
#include <cmath>
#include <deque>
#include <new>

namespace firstlook {
namespace {

using Parameters = std::array<double, 6>;

struct Shared {
  const CameraIntrinsics& camera;
  std::span<const BoardSpec> boards;
  const BundleState& reference;
  const BundleNoise& noise;
};

Vector6d as_vector(const double* p) { return Eigen::Map<const Vector6d>(p); }

/// From a derivative by a further small difference to one by the parameters themselves.
Matrix6d parameter_jacobian(const Vector6d& parameters) {
  Matrix6d j = Matrix6d::Identity();
  j.bottomRightCorner<3, 3>() = left_jacobian(parameters.tail<3>());
  return j;
}

/// Whitened reprojection errors of one view over differences of hand-eye, board (both from the reference) and arm.
class ReprojectionCost final : public ceres::CostFunction {
 public:
  ReprojectionCost(const Shared& shared, const BundleView& view) : shared_(shared), view_(view) {
    set_num_residuals(2 * static_cast<int>(view.points.size()));
    *mutable_parameter_block_sizes() = {6, 6, 6};
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const std::array<Vector6d, 3> at = {as_vector(parameters[0]), as_vector(parameters[1]), as_vector(parameters[2])};
    const ViewGeometry geometry{perturb(shared_.reference.flange_T_camera, at[0]),
                                perturb(shared_.reference.base_T_board[view_.board], at[1]),
                                perturb(view_.base_T_flange_said, at[2])};
    const std::array<Matrix6d, 3> inner = {parameter_jacobian(at[0]), parameter_jacobian(at[1]),
                                           parameter_jacobian(at[2])};
    const BoardSpec& board = shared_.boards[view_.board];
    for (std::size_t i = 0; i < view_.points.size(); ++i) {
      const auto term = corner_term(shared_.camera, geometry, board.corner(view_.points.point(i)));
      if (!term) return false;
      const double scale = std::sqrt(view_.weights[i]) / shared_.noise.corner_sigma_px;
      Eigen::Map<Eigen::Vector2d>(residuals + 2 * i) = scale * (term->pixel - view_.points.corners_px[i]);
      if (jacobians == nullptr) continue;
      const std::array<const Eigen::Matrix<double, 2, 6>*, 3> outer = {&term->d_hand_eye, &term->d_board, &term->d_arm};
      for (std::size_t block = 0; block < outer.size(); ++block) {
        if (jacobians[block] == nullptr) continue;
        Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>>(jacobians[block] + 12 * i) =
            scale * *outer[block] * inner[block];
      }
    }
    return true;
  }

 private:
  const Shared& shared_;
  const BundleView& view_;
};

/// The whitened arm deviation itself.
class ArmPrior final : public ceres::SizedCostFunction<6, 6> {
 public:
  explicit ArmPrior(const ArmSigma& sigma) {
    weight_ << Eigen::Vector3d::Constant(1 / sigma.translation_m), Eigen::Vector3d::Constant(1 / sigma.rotation_rad);
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::Map<Vector6d>{residuals} = weight_.cwiseProduct(as_vector(parameters[0]));
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>{jacobians[0]} = weight_.asDiagonal();
    }
    return true;
  }

 private:
  Vector6d weight_;
};

ceres::Solver::Options solver_options(int iterations_max) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.num_threads = 1;
  options.max_num_iterations = iterations_max;
  options.function_tolerance = 1e-12;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  return options;
}

Status run_ceres(const Shared& shared, std::span<const BundleView> views, int iterations_max, BundleState& result) {
  // Ceres goes through the blocks of a group by their addresses: one array gives them an order of ours.
  std::vector<Parameters> poses(1 + shared.boards.size()), arm(shared.reference.deviations.size());
  Parameters& hand_eye = poses.front();
  const std::span<Parameters> boards = std::span(poses).subspan(1);
  // Ours, and not the problem's: it would lose the cost that it is given when there is no memory to take it in.
  std::deque<ReprojectionCost> reprojection;
  ArmPrior arm_prior(shared.noise.arm_sigma);
  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  auto options = solver_options(iterations_max);
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t i = 0; i < views.size(); ++i) {
    double* const deviation = arm[views[i].station].data();
    const bool first = !problem.HasParameterBlock(deviation);
    if (first) Eigen::Map<Vector6d>{deviation} = shared.reference.deviations[views[i].station];
    problem.AddResidualBlock(&reprojection.emplace_back(shared, views[i]), nullptr, hand_eye.data(),
                             boards[views[i].board].data(), deviation);
    if (!first) continue;
    problem.AddResidualBlock(&arm_prior, nullptr, deviation);
    options.linear_solver_ordering->AddElementToGroup(deviation, 0);
  }
  for (Parameters& pose : poses) options.linear_solver_ordering->AddElementToGroup(pose.data(), 1);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return failure(Fault::kSolveFailed, "least squares: {}", summary.message);
  result.flange_T_camera = perturb(shared.reference.flange_T_camera, as_vector(hand_eye.data()));
  for (std::size_t k = 0; k < boards.size(); ++k) {
    result.base_T_board[k] = perturb(shared.reference.base_T_board[k], as_vector(boards[k].data()));
  }
  for (std::size_t i = 0; i < arm.size(); ++i) result.deviations[i] = as_vector(arm[i].data());
  return {};
}

}  // namespace

Status solve_bundle(const CameraIntrinsics& camera, std::span<const BoardSpec> boards,
                    std::span<const BundleView> views, const BundleNoise& noise, int iterations_max,
                    BundleState& state) {
  // Refuses what has no image at the start, and with it everything that is not finite.
  if (const auto start = linearize_bundle(camera, boards, views, noise.corner_sigma_px, state); !start) {
    return std::unexpected(start.error());
  }
  const BundleState reference = state;
  const Shared shared{camera, boards, reference, noise};
  try {
    return run_ceres(shared, views, iterations_max, state);
  } catch (const std::bad_alloc&) {
    return failure(Fault::kOutOfMemory, "least squares over {} views", views.size());
  }
}

Result<LinearizedBundle> linearize_bundle(const CameraIntrinsics& camera, std::span<const BoardSpec> boards,
                                          std::span<const BundleView> views, double corner_sigma_px,
                                          const BundleState& state) {
  LinearizedBundle result;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const ViewGeometry geometry{state.flange_T_camera, state.base_T_board[views[v].board],
                                perturb(views[v].base_T_flange_said, state.deviations[views[v].station])};
    const BoardSpec& board = boards[views[v].board];
    ViewNormal normal;
    double squared = 0;
    for (std::size_t i = 0; i < views[v].points.size(); ++i) {
      const auto term = corner_term(camera, geometry, board.corner(views[v].points.point(i)));
      if (!term) return failure(Fault::kSolveFailed, "view {}: a corner would be behind the camera", v + 1);
      const Eigen::Vector2d residual = views[v].points.corners_px[i] - term->pixel;
      const double weight = views[v].weights[i];
      normal.add(*term, residual, weight / (corner_sigma_px * corner_sigma_px));
      squared += weight * residual.squaredNorm();
      result.weighted_coordinates += 2 * weight;
    }
    if (!normal.global.allFinite() || !normal.arm.allFinite() || !std::isfinite(squared)) {
      return failure(Fault::kSolveFailed, "view {}: numbers are not finite", v + 1);
    }
    result.views.push_back(normal);
    result.squared_px.push_back(squared);
  }
  return result;
}

}  // namespace firstlook
