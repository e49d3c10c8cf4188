#include "algorithms/calibration/arm_sigma.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace firstlook {
namespace {

Vector6d prior_diagonal(const ArmSigma& sigma) {
  Vector6d p;
  p << Eigen::Vector3d::Constant(1 / (sigma.translation_m * sigma.translation_m)),
      Eigen::Vector3d::Constant(1 / (sigma.rotation_rad * sigma.rotation_rad));
  return p;
}

/// One station with its deviation eliminated (Schur complement).
template <int N>
struct Eliminated {
  Matrix6d arm_inverse;
  Eigen::Matrix<double, N, 6> gain;  ///< global_arm * arm_inverse
  Vector6d right;
};

template <typename Normal>
Eliminated<Normal::kGlobal> eliminate(const Normal& view, const Vector6d& deviation, const Vector6d& prior) {
  Matrix6d arm = view.arm;
  arm.diagonal() += prior;
  Eliminated<Normal::kGlobal> e;
  e.arm_inverse = arm.llt().solve(Matrix6d::Identity());
  e.gain = view.global_arm * e.arm_inverse;
  e.right = view.arm_right - prior.cwiseProduct(deviation);
  return e;
}

/// Inverse of a positive definite matrix whose rows have different units; empty when it is singular to rounding.
template <int N>
std::optional<Eigen::Matrix<double, N, N>> inverse(const Eigen::Matrix<double, N, N>& m) {
  using Matrix = Eigen::Matrix<double, N, N>;
  using Vector = Eigen::Matrix<double, N, 1>;
  const Vector diagonal = m.diagonal();
  if (!m.allFinite() || !(diagonal.minCoeff() > 0)) return std::nullopt;
  const Vector scale = diagonal.cwiseSqrt().cwiseInverse();
  const Matrix scaled = scale.asDiagonal() * m * scale.asDiagonal();
  const Eigen::LDLT<Matrix> ldlt(scaled);
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 1e-14)) return std::nullopt;
  const Matrix scaled_inverse = ldlt.solve(Matrix::Identity(m.rows(), m.rows()));
  const Matrix result = scale.asDiagonal() * scaled_inverse * scale.asDiagonal();
  return Matrix((result + result.transpose()) / 2);
}

/// Which figures are asked for: those that lead to the next sigma, or all.
enum class Figures : std::uint8_t { kDeviations, kAll };

/// The same for one board, where sizes are fixed, and for several.
template <typename Normal>
std::optional<LinearSolution> solve_normals(std::span<const Normal> views, std::span<const Vector6d> deviations,
                                            const ArmSigma& sigma, const GlobalPrior& known = {},
                                            Figures figures = Figures::kAll) {
  constexpr int kGlobal = Normal::kGlobal;
  using Matrix = Eigen::Matrix<double, kGlobal, kGlobal>;
  using Vector = Eigen::Matrix<double, kGlobal, 1>;
  if (views.empty()) return std::nullopt;
  const Eigen::Index size = views.front().global.rows();
  const Vector6d prior = prior_diagonal(sigma);
  std::vector<Eliminated<kGlobal>> eliminated;
  Matrix schur = Matrix::Zero(size, size);
  Vector right = Vector::Zero(size);
  for (std::size_t i = 0; i < views.size(); ++i) {
    eliminated.push_back(eliminate(views[i], deviations[i], prior));
    const Eliminated<kGlobal>& e = eliminated.back();
    schur += views[i].global - e.gain * views[i].global_arm.transpose();
    right += views[i].global_right - e.gain * e.right;
  }
  if (known.weight.size() == size) {
    schur.diagonal() += known.weight;
    right += known.right;
  }
  const auto covariance = inverse<kGlobal>(schur);
  if (!covariance) return std::nullopt;

  LinearSolution solution;
  solution.covariance = *covariance;
  const Vector step = *covariance * right;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eliminated<kGlobal>& e = eliminated[i];
    const Vector6d own = e.arm_inverse * (e.right - views[i].global_arm.transpose() * step);
    solution.deviations.push_back(deviations[i] + own);
    const Matrix6d spread = e.arm_inverse + e.gain.transpose() * *covariance * e.gain;
    solution.deviation_covariance.push_back(spread);
    if (figures != Figures::kAll) continue;
    const Eigen::Matrix<double, kGlobal, 6> cross = -*covariance * e.gain;
    solution.effective_parameters += (views[i].global * *covariance).trace() +
                                     2 * (views[i].global_arm.transpose() * cross).trace() +
                                     (views[i].arm * spread).trace();
  }
  return solution;
}

}  // namespace

StationNormal::StationNormal(int boards, int intrinsics) {
  const Eigen::Index size = 6 + 6 * boards + intrinsics;
  global.setZero(size, size);
  global_arm.setZero(size, 6);
  global_right.setZero(size);
}

void StationNormal::add(const ViewNormal& view, std::size_t board) {
  const Eigen::Index own = 6 + 6 * static_cast<Eigen::Index>(board);
  global.topLeftCorner<6, 6>() += view.global.topLeftCorner<6, 6>();
  global.block<6, 6>(0, own) += view.global.topRightCorner<6, 6>();
  global.block<6, 6>(own, 0) += view.global.bottomLeftCorner<6, 6>();
  global.block<6, 6>(own, own) += view.global.bottomRightCorner<6, 6>();
  global_arm.topRows<6>() += view.global_arm.topRows<6>();
  global_arm.middleRows<6>(own) += view.global_arm.bottomRows<6>();
  global_right.head<6>() += view.global_right.head<6>();
  global_right.segment<6>(own) += view.global_right.tail<6>();
  arm += view.arm;
  arm_right += view.arm_right;
}

void StationNormal::add(const IntrinsicsNormal& view, std::size_t board, int count) {
  const Eigen::Index own = 6 + 6 * static_cast<Eigen::Index>(board);
  const Eigen::Index first = global.rows() - count;
  const auto columns = view.global.leftCols(count);
  global.block(0, first, 6, count) += columns.topRows<6>();
  global.block(own, first, 6, count) += columns.bottomRows<6>();
  global.block(first, 0, count, 6) += columns.topRows<6>().transpose();
  global.block(first, own, count, 6) += columns.bottomRows<6>().transpose();
  global.bottomRightCorner(count, count) += view.own.topLeftCorner(count, count);
  global_arm.bottomRows(count) += view.arm.topRows(count);
  global_right.tail(count) += view.right.head(count);
}

std::optional<LinearSolution> solve_linear(std::span<const ViewNormal> views, std::span<const Vector6d> deviations,
                                           const ArmSigma& sigma) {
  return solve_normals(views, deviations, sigma);
}

std::optional<LinearSolution> solve_linear(std::span<const StationNormal> stations,
                                           std::span<const Vector6d> deviations, const ArmSigma& sigma,
                                           const GlobalPrior& prior) {
  return solve_normals(stations, deviations, sigma, prior);
}

namespace {

/// Root of the mean square, with the expected value as six further squares where that raises it.
double next_sigma(double squares, double axes, double expected) {
  constexpr double kExpectedAxes = 6;
  const double mean = squares / axes;
  const double expected2 = expected * expected;
  return std::sqrt(mean < expected2 ? (squares + kExpectedAxes * expected2) / (axes + kExpectedAxes) : mean);
}

}  // namespace

ArmSigma next_arm_sigma(std::span<const Vector6d> deviations, std::span<const Matrix6d> covariances,
                        const RefinementOptions& options) {
  double translation2 = 0, rotation2 = 0;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    translation2 += deviations[i].head<3>().squaredNorm() + covariances[i].topLeftCorner<3, 3>().trace();
    rotation2 += deviations[i].tail<3>().squaredNorm() + covariances[i].bottomRightCorner<3, 3>().trace();
  }
  const double axes = 3.0 * static_cast<double>(deviations.size());
  ArmSigma next = options.arm_sigma;
  if (next.translation_m <= 0) {
    next.translation_m = std::max(options.arm_sigma_min.translation_m,
                                  next_sigma(translation2, axes, options.arm_sigma_expected.translation_m));
  }
  if (next.rotation_rad <= 0) {
    next.rotation_rad = std::max(options.arm_sigma_min.rotation_rad,
                                 next_sigma(rotation2, axes, options.arm_sigma_expected.rotation_rad));
  }
  return next;
}

namespace {

/// Expectation maximisation creeps where its steps shrink by the same factor each time, and all the more towards a
/// sigma of zero: the sum of the steps to come is taken at once (Aitken 1926), bounded. Starts are too large rather
/// than too small: a leap to several times the start is none that the data asked for.
class Accelerated {
 public:
  explicit Accelerated(double start) : log_start_(std::log(start)) {}

  /// log sigma after the step that expectation maximisation makes.
  double next(double log_sigma, double log_step) {
    constexpr double kFactorMax = 30;
    constexpr double kLogRiseMax = 1.1;  // to three times the start
    const double shrinking = last_step_ == 0 ? 0 : log_step / last_step_;
    const bool steady = shrinking > 0 && shrinking < 1 && !extrapolated_;
    const double factor = steady ? std::min(kFactorMax, 1 / (1 - shrinking)) : 1;
    extrapolated_ = factor > 1;  // the step after a leap says nothing of the shrinking
    last_step_ = log_step;
    return std::min(log_sigma + factor * log_step, std::max(log_start_ + kLogRiseMax, log_sigma + log_step));
  }

 private:
  double log_start_;
  double last_step_ = 0;
  bool extrapolated_ = false;
};

template <typename Normal>
std::optional<ArmSigma> estimate_sigma(std::span<const Normal> views, std::span<const Vector6d> deviations,
                                       ArmSigma start, const RefinementOptions& options,
                                       const GlobalPrior& prior = {}) {
  constexpr int kIterationsMax = 300;  // a step is about 50 us for 25 views
  constexpr double kChangeMin = 2e-5;
  Accelerated translation(start.translation_m), rotation(start.rotation_rad);
  for (int i = 0; i < kIterationsMax; ++i) {
    const auto solution = solve_normals(views, deviations, start, prior, Figures::kDeviations);
    if (!solution) return std::nullopt;
    const ArmSigma next = next_arm_sigma(solution->deviations, solution->deviation_covariance, options);
    const double translation_step = std::log(next.translation_m / start.translation_m);
    const double rotation_step = std::log(next.rotation_rad / start.rotation_rad);
    if (std::max(std::abs(translation_step), std::abs(rotation_step)) < kChangeMin) return next;
    start.translation_m = std::max(std::min(next.translation_m, options.arm_sigma_min.translation_m),
                                   std::exp(translation.next(std::log(start.translation_m), translation_step)));
    start.rotation_rad = std::max(std::min(next.rotation_rad, options.arm_sigma_min.rotation_rad),
                                  std::exp(rotation.next(std::log(start.rotation_rad), rotation_step)));
  }
  return start;
}

}  // namespace

std::optional<ArmSigma> estimate_arm_sigma(std::span<const ViewNormal> views, std::span<const Vector6d> deviations,
                                           ArmSigma start, const RefinementOptions& options) {
  return estimate_sigma(views, deviations, start, options);
}

std::optional<ArmSigma> estimate_arm_sigma(std::span<const StationNormal> stations,
                                           std::span<const Vector6d> deviations, ArmSigma start,
                                           const RefinementOptions& options, const GlobalPrior& prior) {
  return estimate_sigma(stations, deviations, start, options, prior);
}

}  // namespace firstlook
