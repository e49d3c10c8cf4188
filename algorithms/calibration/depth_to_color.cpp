#include "algorithms/calibration/depth_to_color.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "algorithms/calibration/chi_square.hpp"

namespace firstlook {
namespace {

constexpr int kIterationsMax = 50;
constexpr int kWeightingRounds = 3;      // the weights lean on the estimate by less than their own error
constexpr double kMedianOfChi2 = 2.366;  // with 3 degrees of freedom

using Matrix3x7d = Eigen::Matrix<double, 3, 7>;

struct State {
  Pose camera_T_depth = Pose::Identity();
  double scale = 1;
};

State moved(const State& state, const Vector7d& step) {
  return {perturb(state.camera_T_depth, step.head<6>()), state.scale + step[6]};
}

Vector7d difference(const State& truth, const State& estimate) {
  Vector7d d;
  d << pose_difference(truth.camera_T_depth, estimate.camera_T_depth), truth.scale - estimate.scale;
  return d;
}

/// Measured minus expected plane of a stop, with derivatives of the expected one. Measured depths are `scale` times as
/// long, so what stands for 1/z is shorter.
struct Term {
  Eigen::Vector3d residual;
  Matrix3x7d by_mount;
  Eigen::Matrix<double, 3, 6> by_board;
};

std::optional<Term> term_of(const DepthStop& stop, const State& state) {
  const auto expected = expected_plane(state.camera_T_depth, stop.camera_T_board.pose());
  if (!expected || !(state.scale > 0)) return std::nullopt;
  Term term;
  term.residual = stop.plane.inverse_depth - expected->inverse_depth / state.scale;
  term.by_mount << expected->by_camera_T_depth / state.scale, -expected->inverse_depth / (state.scale * state.scale);
  term.by_board = expected->by_camera_T_board / state.scale;
  return term;
}

/// The errors that PlaneExcess is about: offset along the board's normal, tilts about its x and y through its middle.
Eigen::Matrix3d by_excess(const Term& term, const DepthStop& stop) {
  const Eigen::Matrix3d axes = stop.camera_T_board.rotation();
  const Eigen::Vector3d lever = -axes * stop.middle;  // from the middle to the origin
  Eigen::Matrix<double, 6, 3> errors = Eigen::Matrix<double, 6, 3>::Zero();
  errors.col(0).head<3>() = axes.col(2);
  for (int k = 0; k < 2; ++k) errors.col(1 + k) << axes.col(k).cross(lever), axes.col(k);
  return term.by_board * errors;
}

Eigen::Vector3d variances_of(const PlaneExcess& excess) {
  const double tilt = excess.tilt_rad * excess.tilt_rad;
  return {excess.offset_m * excess.offset_m, tilt, tilt};
}

struct Weighted {
  const DepthStop* stop = nullptr;
  Eigen::Matrix3d information = Eigen::Matrix3d::Identity();
};

struct Problem {
  std::vector<Weighted> stops;
  State believed;
  Matrix7d belief = Matrix7d::Zero();  ///< information
};

/// Sum of squares, and the normal equations where they are asked for.
struct Normal {
  Matrix7d information = Matrix7d::Zero();
  Vector7d right = Vector7d::Zero();
};
std::optional<double> cost_at(const Problem& problem, const State& state, Normal* normal = nullptr) {
  const Vector7d off = difference(state, problem.believed);
  double cost = off.dot(problem.belief * off);
  if (normal != nullptr) *normal = {problem.belief, -problem.belief * off};
  for (const Weighted& weighted : problem.stops) {
    const auto term = term_of(*weighted.stop, state);
    if (!term) return std::nullopt;
    cost += term->residual.dot(weighted.information * term->residual);
    if (normal == nullptr) continue;
    const Eigen::Matrix<double, 7, 3> gain = term->by_mount.transpose() * weighted.information;
    normal->information += gain * term->by_mount;
    normal->right += gain * term->residual;
  }
  return std::isfinite(cost) ? std::optional(cost) : std::nullopt;
}

/// Levenberg 1944, Marquardt 1963; the damping is relative to the diagonal, for rows have different units.
std::optional<State> minimized(const Problem& problem, State state) {
  Normal normal;
  auto cost = cost_at(problem, state, &normal);
  if (!cost) return std::nullopt;
  double damping = 1e-4;
  for (int i = 0; i < kIterationsMax && damping < 1e12; ++i) {
    Matrix7d damped = normal.information;
    damped.diagonal() *= 1 + damping;
    const State next = moved(state, damped.ldlt().solve(normal.right));
    const auto lower = cost_at(problem, next);
    if (!lower || !(*lower < *cost)) {
      damping *= 10;
      continue;
    }
    const bool settled = *cost - *lower <= 1e-12 * *cost;
    state = next;
    cost = cost_at(problem, state, &normal);
    if (settled || !cost) break;
    damping = std::max(1e-12, damping / 10);
  }
  return state;
}

/// What scatters the residuals.
struct Noise {
  double inverse_depth = 0;  ///< of a pixel
  PlaneExcess excess;
};

/// What the residual of a stop may be: noise of its pixels, of its corners, and the excess.
std::optional<Eigen::Matrix3d> information_of(const DepthStop& stop, const Term& term, const Noise& noise) {
  const Eigen::Matrix3d extra = by_excess(term, stop);
  const Eigen::Matrix3d covariance = noise.inverse_depth * noise.inverse_depth * stop.plane.unit_information.inverse() +
                                     term.by_board * stop.covariance * term.by_board.transpose() +
                                     extra * variances_of(noise.excess).asDiagonal() * extra.transpose();
  Eigen::Matrix3d information = covariance.inverse();
  if (!information.allFinite()) return std::nullopt;
  return information;
}

/// Of all pixels, from the scatter in each stop.
double pooled_noise(std::span<const DepthStop> stops) {
  double squares = 0, pixels = 0;
  for (const DepthStop& stop : stops) {
    squares += stop.plane.pixels * stop.plane.noise * stop.plane.noise;
    pixels += stop.plane.pixels;
  }
  return std::sqrt(squares / pixels);
}

/// The estimate from the stops that `used` says, weights and estimate in turn.
std::optional<State> solved(std::span<const DepthStop> stops, std::span<const DepthStopFit> fits, const Noise& noise,
                            Problem& problem, State state) {
  for (int round = 0; round < kWeightingRounds; ++round) {
    problem.stops.clear();
    for (std::size_t i = 0; i < stops.size(); ++i) {
      if (!fits[i].used) continue;
      const auto term = term_of(stops[i], state);
      const auto information = term ? information_of(stops[i], *term, noise) : std::nullopt;
      if (!information) return std::nullopt;
      problem.stops.push_back({&stops[i], *information});
    }
    const auto next = minimized(problem, state);
    if (!next) return std::nullopt;
    state = *next;
  }
  return state;
}

bool judge(std::span<const DepthStop> stops, const State& state, const Noise& noise, std::vector<DepthStopFit>& fits) {
  for (std::size_t i = 0; i < stops.size(); ++i) {
    const auto term = term_of(stops[i], state);
    const auto information = term ? information_of(stops[i], *term, noise) : std::nullopt;
    if (!information) return false;
    fits[i].chi2 = term->residual.dot(*information * term->residual);
    const Eigen::Vector3d measured = stops[i].plane.inverse_depth, expected = measured - term->residual;
    const Eigen::Vector3d middle =
        state.camera_T_depth.inverse(Eigen::Isometry) * (stops[i].camera_T_board * stops[i].middle);
    const Eigen::Vector3d ray = middle / middle.z();
    fits[i].offset_m = 1 / measured.dot(ray) - 1 / expected.dot(ray);
    fits[i].tilt_rad = std::atan2(measured.cross(expected).norm(), measured.dot(expected));
  }
  return true;
}

/// One step of expectation maximisation: the errors of each stop given its residual, and their mean squares.
PlaneExcess better_excess(std::span<const DepthStop> stops, std::span<const DepthStopFit> fits, const State& state,
                          const Noise& noise) {
  const Eigen::Vector3d before = variances_of(noise.excess);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < stops.size(); ++i) {
    if (!fits[i].used) continue;
    const auto term = term_of(stops[i], state);
    const auto information = term ? information_of(stops[i], *term, noise) : std::nullopt;
    if (!information) continue;
    const Eigen::Matrix3d extra = by_excess(*term, stops[i]);
    const Eigen::Matrix3d gain = before.asDiagonal() * extra.transpose() * *information;
    const Eigen::Matrix3d covariance = Eigen::Matrix3d(before.asDiagonal()) - gain * extra * before.asDiagonal();
    sum += (gain * term->residual).cwiseAbs2() + covariance.diagonal();
    ++count;
  }
  return {std::sqrt(sum[0] / count), std::sqrt((sum[1] + sum[2]) / (2 * count))};
}

/// Takes out the stop that fits worst when it cannot be right; false when all can. The median says how much the stops
/// disagree anyway.
bool leave_out_worst(std::vector<DepthStopFit>& fits, double wrong_share) {
  std::vector<double> chi2;
  DepthStopFit* worst = nullptr;
  for (DepthStopFit& fit : fits) {
    if (!fit.used) continue;
    chi2.push_back(fit.chi2);
    if (worst == nullptr || fit.chi2 > worst->chi2) worst = &fit;
  }
  const auto middle = chi2.begin() + static_cast<std::ptrdiff_t>(chi2.size() / 2);
  std::nth_element(chi2.begin(), middle, chi2.end());
  const double common = std::max(1.0, *middle / kMedianOfChi2);
  if (worst->chi2 <= common * chi_square_quantile(1 - wrong_share, 3)) return false;
  worst->used = false;
  return true;
}

std::string axis_text(const Eigen::Vector3d& axis) {
  constexpr std::array<std::string_view, 3> kNames = {"x", "y", "z"};
  Eigen::Index largest = 0;
  const double share = axis.cwiseAbs().maxCoeff(&largest);
  if (share > 0.95) return std::string(kNames[static_cast<std::size_t>(largest)]);
  const Eigen::Vector3d sign = axis[largest] < 0 ? Eigen::Vector3d(-axis) : axis;
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", sign.x(), sign.y(), sign.z());
}

/// @param direction unit vector in units of what was believed
std::string name_of(const Vector7d& direction) {
  const Eigen::Vector3d translation = direction.head<3>(), rotation = direction.segment<3>(3);
  const double t = translation.norm(), r = rotation.norm(), s = std::abs(direction[6]);
  if (s >= t && s >= r) return "depth scale";
  if (t >= r) return "translation along " + axis_text(translation / t);
  return "rotation about " + axis_text(rotation / r);
}

/// Covariance after in units of sigma before: 1 in a direction that nothing was said about.
struct Whitened {
  Eigen::SelfAdjointEigenSolver<Matrix7d> eigen;
  explicit Whitened(const Matrix7d& after, const Vector7d& sigma_before)
      : eigen(sigma_before.cwiseInverse().asDiagonal() * after * sigma_before.cwiseInverse().asDiagonal()) {}
  [[nodiscard]] double ratio(int k) const { return std::sqrt(std::max(0.0, eigen.eigenvalues()[k])); }
  [[nodiscard]] Vector7d direction(int k) const { return eigen.eigenvectors().col(k); }
};

/// The untold directions, axes by themselves where they are among them: eigenvectors of alike values are any mixture.
std::vector<UntoldDirection> untold_directions(const Whitened& whitened, double told_ratio) {
  constexpr double kAmong = 0.95;
  Matrix7d space = Matrix7d::Zero(), covariance = Matrix7d::Zero();
  for (int k = 0; k < 7; ++k) {
    const Vector7d v = whitened.direction(k);
    if (whitened.ratio(k) > told_ratio) space += v * v.transpose();
    covariance += whitened.eigen.eigenvalues()[k] * v * v.transpose();
  }
  std::vector<UntoldDirection> untold;
  const auto take = [&](const Vector7d& v) {
    untold.push_back({name_of(v), std::sqrt(std::max(0.0, v.dot(covariance * v)))});
    const Matrix7d rest = Matrix7d::Identity() - v * v.transpose();
    space = (rest * space * rest).eval();
  };
  for (int axis = 0; axis < 7; ++axis) {
    const Vector7d v = space.col(axis);  // the axis as far as it lies in the space
    if (v[axis] > kAmong * kAmong) take(v.normalized());
  }
  const Eigen::SelfAdjointEigenSolver<Matrix7d> rest(space);
  for (int k = 6; k >= 0 && rest.eigenvalues()[k] > 0.5; --k) take(rest.eigenvectors().col(k));
  return untold;
}

/// The estimate differs from the belief with covariance (before - after), direction by direction.
BeliefTest test_belief(const Whitened& whitened, const Vector7d& off_whitened, const DepthToColorOptions& options) {
  BeliefTest test;
  for (int k = 0; k < 7; ++k) {
    const double ratio = whitened.ratio(k);
    if (ratio > options.told_ratio) continue;
    const double off = whitened.direction(k).dot(off_whitened);
    test.chi2 += off * off / (1 - ratio * ratio);
    ++test.degrees_of_freedom;
  }
  if (test.degrees_of_freedom > 0) {
    test.chi2_limit = chi_square_quantile(1 - options.contradiction, test.degrees_of_freedom);
  }
  return test;
}

Status check_input(std::span<const DepthStop> stops, const DepthMount& believed, const DepthToColorOptions& options) {
  if (static_cast<int>(stops.size()) < options.stops_min) {
    return failure(Fault::kTooFewViews, "the depth camera saw the board's plane at {} stops, {} are needed",
                   stops.size(), options.stops_min);
  }
  const Vector7d variances = believed.covariance.diagonal();
  if (!variances.allFinite() || !(variances.minCoeff() > 0) || !believed.camera_T_depth.pose().matrix().allFinite()) {
    return failure(Fault::kSolveFailed,
                   "the believed pose of the depth camera needs finite numbers and sigmas above 0");
  }
  for (std::size_t i = 0; i < stops.size(); ++i) {
    const DepthStop& stop = stops[i];
    if (!stop.camera_T_board.pose().matrix().allFinite() || !stop.covariance.allFinite() || !stop.middle.allFinite() ||
        !stop.plane.inverse_depth.allFinite() || !(stop.plane.noise > 0) || stop.plane.pixels <= 0) {
      return failure(Fault::kSolveFailed, "stop {}: board pose or depth plane is not finite", i + 1);
    }
  }
  return {};
}

/// The least squares with its stops judged. What of the stops is used stands in `fits`.
struct Solver {
  std::span<const DepthStop> stops;
  const DepthToColorOptions& options;
  Problem problem{};
  Noise noise{};
  State state{};
  std::vector<DepthStopFit> fits{};

  [[nodiscard]] std::size_t used() const {
    return static_cast<std::size_t>(
        std::count_if(fits.begin(), fits.end(), [](const DepthStopFit& fit) { return fit.used; }));
  }
  [[nodiscard]] double chi2() const {
    double sum = 0;
    for (const DepthStopFit& fit : fits) sum += fit.used ? fit.chi2 : 0;
    return sum;
  }
  [[nodiscard]] double offset_rms_m() const {
    double squares = 0;
    for (const DepthStopFit& fit : fits) squares += fit.used ? fit.offset_m * fit.offset_m : 0;
    return std::sqrt(squares / static_cast<double>(used()));
  }

  [[nodiscard]] Status solve() {
    const auto next = solved(stops, fits, noise, problem, state);
    if (!next || !judge(stops, *next, noise, fits)) {
      return failure(Fault::kSolveFailed, "no pose of the depth camera puts the board's planes before it");
    }
    state = *next;
    return {};
  }

  [[nodiscard]] Status solve_without_wrong_stops() {
    do {
      if (Status status = solve(); !status) return status;
      const auto left_out = static_cast<double>(stops.size() - used());
      if (left_out > options.left_out_max * static_cast<double>(stops.size()) ||
          static_cast<int>(used()) < options.stops_min) {
        return failure(Fault::kSolveFailed, "the board's planes at {} of {} stops contradict the others",
                       stops.size() - used(), stops.size());
      }
    } while (leave_out_worst(fits, options.wrong_stop));
    if (offset_rms_m() > options.offset_rms_max_m) {
      return failure(Fault::kSolveFailed, "the board's planes contradict each other: {:.1f} mm RMS at {} stops",
                     1000 * offset_rms_m(), used());
    }
    return {};
  }

  [[nodiscard]] Status estimate_excess() {
    constexpr int kRounds = 40;
    noise.excess = {1e-3, 2e-3};
    for (int round = 0; round < kRounds; ++round) {
      noise.excess = better_excess(stops, fits, state, noise);
      if (Status status = solve(); !status) return status;
    }
    // Offsets fitted translation and scale, tilts the rotation: that share of them is missing in their squares.
    const auto count = static_cast<double>(used());
    noise.excess.offset_m *= std::sqrt(count / std::max(1.0, count - 4));
    noise.excess.tilt_rad *= std::sqrt(2 * count / std::max(1.0, 2 * count - 3));
    return solve();
  }
};

int told_numbers(const Whitened& whitened, double told_ratio) {
  int told = 0;
  for (int k = 0; k < 7; ++k) told += whitened.ratio(k) <= told_ratio ? 1 : 0;
  return told;
}

}  // namespace

DepthMount believed_mount(const Transform<Camera, Depth>& camera_T_depth, double sigma_translation_m,
                          double sigma_rotation_rad, double sigma_scale) {
  Vector7d sigma;
  sigma << Eigen::Vector3d::Constant(sigma_translation_m), Eigen::Vector3d::Constant(sigma_rotation_rad), sigma_scale;
  DepthMount mount{camera_T_depth, 1, Matrix7d::Zero()};
  mount.covariance.diagonal() = sigma.cwiseAbs2();
  return mount;
}

Result<DepthToColor> estimate_depth_to_color(std::span<const DepthStop> stops, const DepthMount& believed,
                                             const DepthToColorOptions& options) {
  if (Status status = check_input(stops, believed, options); !status) return std::unexpected(status.error());
  const State before{believed.camera_T_depth.pose(), believed.depth_scale};
  Solver solver{.stops = stops, .options = options};
  solver.problem.believed = before;
  solver.problem.belief = believed.covariance.inverse();
  solver.noise.inverse_depth = pooled_noise(stops);
  solver.state = before;
  solver.fits.resize(stops.size());
  if (Status status = solver.solve_without_wrong_stops(); !status) return std::unexpected(status.error());
  const Vector7d sigma_before = believed.covariance.diagonal().cwiseSqrt();
  const auto covariance = [&]() -> Matrix7d {
    Normal normal;
    return cost_at(solver.problem, solver.state, &normal) ? Matrix7d(normal.information.inverse())
                                                          : Matrix7d(believed.covariance);
  };
  DepthToColor result;
  const int told = told_numbers(Whitened(covariance(), sigma_before), options.told_ratio);
  result.degrees_of_freedom = 3 * static_cast<int>(solver.used()) - told;
  result.chi2 = solver.chi2();
  if (result.degrees_of_freedom > 0 &&
      result.chi2 > chi_square_quantile(1 - options.chance_min, result.degrees_of_freedom)) {
    if (Status status = solver.estimate_excess(); !status) return std::unexpected(status.error());
  }
  const Vector7d off = difference(solver.state, before);
  const Whitened whitened(covariance(), sigma_before);
  result.mount = {Transform<Camera, Depth>(solver.state.camera_T_depth), solver.state.scale, covariance()};
  result.moved = off.head<6>();
  result.noise_at_1m = solver.noise.inverse_depth;
  result.offset_rms_m = solver.offset_rms_m();
  result.excess = solver.noise.excess;
  result.untold = untold_directions(whitened, options.told_ratio);
  result.belief = test_belief(whitened, sigma_before.cwiseInverse().cwiseProduct(off), options);
  result.stops = std::move(solver.fits);
  return result;
}

}  // namespace firstlook
