#include "algorithms/calibration/bundle.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "algorithms/calibration/arm_sigma.hpp"

namespace firstlook {
namespace {

struct Problem {
  std::span<const BoardSpec> boards;
  std::span<const BundleView> views;
  const BundleNoise& noise;
  const IntrinsicsBelief& intrinsics;
};

/// A state with its normal equations and the whitened squares there.
struct Point {
  BundleState state;
  LinearizedBundle bundle;
  double cost = 0;
};

Vector6d prior_weight(const ArmSigma& sigma) {
  Vector6d weight;
  weight << Eigen::Vector3d::Constant(1 / (sigma.translation_m * sigma.translation_m)),
      Eigen::Vector3d::Constant(1 / (sigma.rotation_rad * sigma.rotation_rad));
  return weight;
}

Result<Point> point_at(const Problem& problem, BundleState state) {
  const int count = problem.intrinsics.count;
  auto bundle = linearize_bundle(problem.boards, problem.views, problem.noise.corner_sigma_px, count > 0, state);
  if (!bundle) return std::unexpected(bundle.error());
  double cost = 0;
  for (const double squared : bundle->squared_px) cost += squared;
  cost /= problem.noise.corner_sigma_px * problem.noise.corner_sigma_px;
  const Vector6d weight = prior_weight(problem.noise.arm_sigma);
  for (const Vector6d& deviation : state.deviations) cost += weight.dot(deviation.cwiseAbs2());
  if (count > 0) {
    const IntrinsicsVector off = intrinsics_vector(state.camera) - problem.intrinsics.mean;
    cost += problem.intrinsics.weight.head(count).dot(off.cwiseAbs2().head(count));
  }
  return Point{std::move(state), std::move(*bundle), cost};
}

/// The normal equations of each station over its deviation as it is written (perturb turns by Exp of the whole of it),
/// where the views give them over a small further turn.
std::vector<StationNormal> station_normals(const Problem& problem, const Point& at) {
  const int count = problem.intrinsics.count;
  std::vector<StationNormal> stations(at.state.deviations.size(),
                                      StationNormal(static_cast<int>(problem.boards.size()), count));
  for (std::size_t v = 0; v < problem.views.size(); ++v) {
    StationNormal& station = stations[problem.views[v].station];
    station.add(at.bundle.views[v], problem.views[v].board);
    if (count > 0) station.add(at.bundle.intrinsics[v], problem.views[v].board, count);
  }
  const Vector6d weight = prior_weight(problem.noise.arm_sigma);
  for (std::size_t s = 0; s < stations.size(); ++s) {
    StationNormal& station = stations[s];
    const Vector6d& deviation = at.state.deviations[s];
    Matrix6d inner = Matrix6d::Identity();
    inner.bottomRightCorner<3, 3>() = left_jacobian(deviation.tail<3>());
    station.global_arm = (station.global_arm * inner).eval();
    station.arm = (inner.transpose() * station.arm * inner).eval();
    station.arm.diagonal() += weight;
    station.arm_right = (inner.transpose() * station.arm_right - weight.cwiseProduct(deviation)).eval();
  }
  return stations;
}

/// A step of Levenberg and Marquardt: of hand-eye, boards and intrinsics, and of each station's deviation.
struct Step {
  Eigen::VectorXd global;
  std::vector<Vector6d> deviations;
};

/// Solves (H + damping diag(H)) step = right, deviations eliminated first (Schur complement). Empty when it is singular
/// to rounding: more damping helps.
std::optional<Step> damped_step(const Problem& problem, const Point& at, std::span<const StationNormal> stations,
                                double damping) {
  const Eigen::Index size = stations.front().global.rows();
  const Eigen::Index count = problem.intrinsics.count;
  Eigen::MatrixXd global = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  for (const StationNormal& station : stations) {
    global += station.global;
    right += station.global_right;
  }
  if (count > 0) {
    global.diagonal().tail(count) += problem.intrinsics.weight.head(count);
    right.tail(count) += problem.intrinsics.right(at.state.camera).head(count);
  }
  const Eigen::VectorXd diagonal = global.diagonal();
  global.diagonal() += damping * diagonal;
  std::vector<Eigen::Matrix<double, Eigen::Dynamic, 6>> gains;
  std::vector<Eigen::LLT<Matrix6d>> arms;
  for (const StationNormal& station : stations) {
    Matrix6d arm = station.arm;
    arm.diagonal() *= 1 + damping;
    arms.emplace_back(arm);
    gains.emplace_back(arms.back().solve(station.global_arm.transpose()).transpose());
    global -= gains.back() * station.global_arm.transpose();
    right -= gains.back() * station.arm_right;
  }
  // Rows have different units.
  Eigen::VectorXd scale(size);
  for (Eigen::Index i = 0; i < size; ++i) scale[i] = diagonal[i] > 0 ? 1 / std::sqrt(diagonal[i]) : 1;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(scale.asDiagonal() * global * scale.asDiagonal());
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 0)) return std::nullopt;
  Step step;
  step.global = scale.cwiseProduct(ldlt.solve(scale.cwiseProduct(right)));
  if (!step.global.allFinite()) return std::nullopt;
  for (std::size_t s = 0; s < stations.size(); ++s) {
    step.deviations.emplace_back(
        arms[s].solve(stations[s].arm_right - stations[s].global_arm.transpose() * step.global));
  }
  return step;
}

BundleState moved(const Problem& problem, const BundleState& state, const Step& step) {
  BundleState next = state;
  next.flange_T_camera = perturb(state.flange_T_camera, step.global.head<6>());
  for (std::size_t k = 0; k < next.base_T_board.size(); ++k) {
    next.base_T_board[k] = perturb(state.base_T_board[k], step.global.segment<6>(6 + 6 * static_cast<Eigen::Index>(k)));
  }
  for (std::size_t s = 0; s < next.deviations.size(); ++s) next.deviations[s] += step.deviations[s];
  const Eigen::Index count = problem.intrinsics.count;
  if (count > 0) {
    IntrinsicsVector numbers = intrinsics_vector(state.camera);
    numbers.head(count) += step.global.tail(count);
    next.camera = with_intrinsics(state.camera, numbers);
  }
  return next;
}

/// Levenberg 1944, Marquardt 1963: a step that lowers the squares is taken and the damping falls, else it grows. Ends
/// when the squares stand still to rounding or no step helps.
Point minimize(const Problem& problem, Point at, int iterations_max) {
  constexpr double kDampingStart = 1e-4, kDampingMin = 1e-12, kDampingMax = 1e12;
  constexpr double kStandsStill = 1e-12;  // relative
  double damping = kDampingStart;
  std::vector<StationNormal> stations = station_normals(problem, at);
  for (int i = 0; i < iterations_max && damping < kDampingMax; ++i) {
    const auto step = damped_step(problem, at, stations, damping);
    auto next =
        step ? point_at(problem, moved(problem, at.state, *step)) : Result<Point>(failure(Fault::kSolveFailed, ""));
    if (!next || !(next->cost < at.cost)) {
      damping *= 10;
      continue;
    }
    const bool settled = at.cost - next->cost <= kStandsStill * at.cost;
    at = std::move(*next);
    if (settled) break;
    damping = std::max(kDampingMin, damping / 10);
    stations = station_normals(problem, at);
  }
  return at;
}

/// Adds one view; false when a corner has no image.
bool linearize_view(const CameraIntrinsics& camera, const ViewGeometry& geometry, const BoardSpec& board,
                    const BundleView& view, double corner_sigma_px, bool with_intrinsics, LinearizedBundle& result) {
  ViewNormal normal;
  IntrinsicsNormal intrinsics;
  double squared = 0;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    const auto term = corner_term(camera, geometry, board.corner(view.points.point(i)));
    if (!term) return false;
    const Eigen::Vector2d residual = view.points.corners_px[i] - term->pixel;
    const double weight = view.weights[i];
    const double information = weight / (corner_sigma_px * corner_sigma_px);
    normal.add(*term, residual, information);
    if (with_intrinsics) {
      intrinsics.add(*term, intrinsics_jacobian(camera, term->normalized), residual, information);
    }
    squared += weight * residual.squaredNorm();
    result.weighted_coordinates += 2 * weight;
  }
  result.views.push_back(normal);
  if (with_intrinsics) result.intrinsics.push_back(intrinsics);
  result.squared_px.push_back(squared);
  return true;
}

}  // namespace

Status solve_bundle(std::span<const BoardSpec> boards, std::span<const BundleView> views, const BundleNoise& noise,
                    const IntrinsicsBelief& intrinsics, int iterations_max, BundleState& state) {
  const Problem problem{boards, views, noise, intrinsics};
  auto start = point_at(problem, state);
  if (!start) return std::unexpected(start.error());
  state = minimize(problem, std::move(*start), iterations_max).state;
  return {};
}

Result<LinearizedBundle> linearize_bundle(std::span<const BoardSpec> boards, std::span<const BundleView> views,
                                          double corner_sigma_px, bool with_intrinsics, const BundleState& state) {
  LinearizedBundle result;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const ViewGeometry geometry{state.flange_T_camera, state.base_T_board[views[v].board],
                                perturb(views[v].base_T_flange_said, state.deviations[views[v].station])};
    if (!linearize_view(state.camera, geometry, boards[views[v].board], views[v], corner_sigma_px, with_intrinsics,
                        result)) {
      return failure(Fault::kSolveFailed, "view {}: a corner would be behind the camera", v + 1);
    }
    const ViewNormal& normal = result.views.back();
    if (!normal.global.allFinite() || !normal.arm.allFinite() || !std::isfinite(result.squared_px.back())) {
      return failure(Fault::kSolveFailed, "view {}: numbers are not finite", v + 1);
    }
  }
  return result;
}

}  // namespace firstlook
