#include "tests/oracle/calibration/ceres_bundle.hpp"

#include <ceres/ceres.h>

#include <array>
#include <cmath>

namespace firstlook::test {
namespace {

using Parameters = std::array<double, 6>;

struct Shared {
  std::span<const BoardSpec> boards;
  const BundleState& reference;
  const BundleNoise& noise;
  const IntrinsicsBelief& intrinsics;
};

Vector6d as_vector(const double* p) { return Eigen::Map<const Vector6d>(p); }

/// From a derivative by a further small difference to one by the parameters themselves.
Matrix6d parameter_jacobian(const Vector6d& parameters) {
  Matrix6d j = Matrix6d::Identity();
  j.bottomRightCorner<3, 3>() = left_jacobian(parameters.tail<3>());
  return j;
}

/// The reference's camera with differences of the numbers that are solved for.
CameraIntrinsics moved_camera(const Shared& shared, const double* difference) {
  IntrinsicsVector numbers = intrinsics_vector(shared.reference.camera);
  numbers.head(shared.intrinsics.count) += Eigen::Map<const Eigen::VectorXd>(difference, shared.intrinsics.count);
  return with_intrinsics(shared.reference.camera, numbers);
}

/// Whitened reprojection errors of one view over differences of hand-eye, board (both from the reference), arm, and the
/// intrinsics that are solved for (from the reference).
class ReprojectionCost final : public ceres::CostFunction {
 public:
  ReprojectionCost(const Shared& shared, const BundleView& view) : shared_(shared), view_(view) {
    set_num_residuals(2 * static_cast<int>(view.points.size()));
    *mutable_parameter_block_sizes() = {6, 6, 6};
    if (with_intrinsics()) mutable_parameter_block_sizes()->push_back(shared.intrinsics.count);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const std::array<Vector6d, 3> at = {as_vector(parameters[0]), as_vector(parameters[1]), as_vector(parameters[2])};
    const ViewGeometry geometry{perturb(shared_.reference.flange_T_camera, at[0]),
                                perturb(shared_.reference.base_T_board[view_.board], at[1]),
                                perturb(view_.base_T_flange_said, at[2])};
    const std::array<Matrix6d, 3> inner = {parameter_jacobian(at[0]), parameter_jacobian(at[1]),
                                           parameter_jacobian(at[2])};
    const CameraIntrinsics camera =
        with_intrinsics() ? moved_camera(shared_, parameters[kIntrinsicsBlock]) : shared_.reference.camera;
    const BoardSpec& board = shared_.boards[view_.board];
    for (std::size_t i = 0; i < view_.points.size(); ++i) {
      const auto term = corner_term(camera, geometry, board.corner(view_.points.point(i)));
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
      if (!with_intrinsics() || jacobians[kIntrinsicsBlock] == nullptr) continue;
      const Eigen::Index count = shared_.intrinsics.count;
      Eigen::Map<Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor>>(
          jacobians[kIntrinsicsBlock] + 2 * count * static_cast<Eigen::Index>(i), 2, count) =
          scale * intrinsics_jacobian(camera, term->normalized).leftCols(count);
    }
    return true;
  }

 private:
  static constexpr std::size_t kIntrinsicsBlock = 3;
  [[nodiscard]] bool with_intrinsics() const { return shared_.intrinsics.count > 0; }

  const Shared& shared_;
  const BundleView& view_;
};

/// The whitened difference of the intrinsics from what is believed of them; 0 where nothing is.
class BeliefCost final : public ceres::CostFunction {
 public:
  explicit BeliefCost(const Shared& shared) : shared_(shared) {
    set_num_residuals(shared.intrinsics.count);
    *mutable_parameter_block_sizes() = {shared.intrinsics.count};
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index count = shared_.intrinsics.count;
    const IntrinsicsVector scale = shared_.intrinsics.weight.cwiseSqrt();
    const IntrinsicsVector off = intrinsics_vector(moved_camera(shared_, parameters[0])) - shared_.intrinsics.mean;
    Eigen::Map<Eigen::VectorXd>(residuals, count) = scale.cwiseProduct(off).head(count);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::MatrixXd>(jacobians[0], count, count) = scale.head(count).asDiagonal();
    }
    return true;
  }

 private:
  const Shared& shared_;
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
  const std::size_t poses = 1 + shared.boards.size();
  std::vector<double> global(6 * poses + IntrinsicsVector::SizeAtCompileTime);
  std::vector<Parameters> arm(shared.reference.deviations.size());
  const auto pose = [&](std::size_t number) { return global.data() + 6 * number; };  // 0: hand-eye, then the boards
  double* const camera = pose(poses);
  ceres::Problem problem;
  auto options = solver_options(iterations_max);
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t i = 0; i < views.size(); ++i) {
    double* const deviation = arm[views[i].station].data();
    const bool first = !problem.HasParameterBlock(deviation);
    if (first) Eigen::Map<Vector6d>{deviation} = shared.reference.deviations[views[i].station];
    std::vector<double*> blocks = {pose(0), pose(1 + views[i].board), deviation};
    if (shared.intrinsics.count > 0) blocks.push_back(camera);
    problem.AddResidualBlock(new ReprojectionCost(shared, views[i]), nullptr, blocks);
    if (!first) continue;
    problem.AddResidualBlock(new ArmPrior(shared.noise.arm_sigma), nullptr, deviation);
    options.linear_solver_ordering->AddElementToGroup(deviation, 0);
  }
  for (std::size_t k = 0; k < poses; ++k) options.linear_solver_ordering->AddElementToGroup(pose(k), 1);
  if (shared.intrinsics.count > 0) {
    problem.AddResidualBlock(new BeliefCost(shared), nullptr, camera);
    options.linear_solver_ordering->AddElementToGroup(camera, 1);
  }
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return failure(Fault::kSolveFailed, "least squares: {}", summary.message);
  result.camera = moved_camera(shared, camera);
  result.flange_T_camera = perturb(shared.reference.flange_T_camera, as_vector(pose(0)));
  for (std::size_t k = 0; k < shared.boards.size(); ++k) {
    result.base_T_board[k] = perturb(shared.reference.base_T_board[k], as_vector(pose(1 + k)));
  }
  for (std::size_t i = 0; i < arm.size(); ++i) result.deviations[i] = as_vector(arm[i].data());
  return {};
}

}  // namespace

Status solve_bundle_with_ceres(std::span<const BoardSpec> boards, std::span<const BundleView> views,
                               const BundleNoise& noise, const IntrinsicsBelief& intrinsics, int iterations_max,
                               BundleState& state) {
  const BundleState reference = state;
  const Shared shared{boards, reference, noise, intrinsics};
  return run_ceres(shared, views, iterations_max, state);
}

}  // namespace firstlook::test
