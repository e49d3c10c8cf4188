#include "algorithms/calibration/touched_board.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "algorithms/calibration/absolute_orientation.hpp"
#include "algorithms/calibration/chi_square.hpp"
#include "algorithms/calibration/moved_by.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Indices = std::vector<std::size_t>;

constexpr double kExact_m = 1e-7;        // sigma of a tip that is called exact: a thousandth of what an arm repeats
constexpr double kLineShare = 0.25;      // RMS distance from a line that still counts as one, in squares
constexpr double kChi3Median = 1.5382;   // median length of three standard normal errors
constexpr double kExpectedWorth = 6;     // degrees of freedom: the expected sigma counts like two touches
constexpr double kSignificance = 0.001;  // of the residuals
constexpr int kDraws = 300;              // with a third of wrong touches all fail once in 10^20
constexpr double kDegrees = 180 / std::numbers::pi;

/// What is solved for: where the board and where the tip is.
struct BoardAndTip {
  Pose base_T_board = Pose::Identity();
  Eigen::Vector3d flange_p_tip = Eigen::Vector3d::Zero();
};

/// The problem with its numbers: touches, points, and what is known beforehand.
struct Problem {
  std::span<const Touch> touches;
  std::vector<Eigen::Vector3d> points;  ///< in the board, one for each touch
  std::optional<TipOffset> tip;

  [[nodiscard]] std::size_t touches_min() const { return tip ? 3 : 4; }
  [[nodiscard]] int unknowns() const { return tip ? 6 : 9; }
  [[nodiscard]] Eigen::Vector3d residual(std::size_t i, const BoardAndTip& x) const {
    return touches[i].base_T_flange * x.flange_p_tip - x.base_T_board * points[i];
  }
};

/// Normal equations of d = (pose_difference of the board, tip), residuals in units of `sigma_m`.
struct Normal {
  Matrix9d h = Matrix9d::Zero();
  Vector9d g = Vector9d::Zero();
  double touch_chi2 = 0, tip_chi2 = 0;
  [[nodiscard]] double cost() const { return touch_chi2 + tip_chi2; }
};

Normal linearise(const Problem& problem, const Indices& used, const BoardAndTip& x, double sigma_m) {
  Normal n;
  const double weight = 1 / (sigma_m * sigma_m);
  for (const std::size_t i : used) {
    Eigen::Matrix<double, 3, 9> j;
    j << -Eigen::Matrix3d::Identity(), cross_matrix(x.base_T_board.linear() * problem.points[i]),
        problem.touches[i].base_T_flange.rotation();
    const Eigen::Vector3d r = problem.residual(i, x);
    n.h += weight * j.transpose() * j;
    n.g += weight * j.transpose() * r;
    n.touch_chi2 += weight * r.squaredNorm();
  }
  if (problem.tip) {
    const double sigma = std::max(problem.tip->sigma_m, kExact_m);
    const Eigen::Vector3d off = (x.flange_p_tip - problem.tip->flange_p_tip_m) / sigma;
    n.h.bottomRightCorner<3, 3>().diagonal().array() += 1 / (sigma * sigma);
    n.g.tail<3>() += off / sigma;
    n.tip_chi2 = off.squaredNorm();
  }
  return n;
}

/// Levenberg-Marquardt; a few steps, since the residuals are nearly linear in all but the board's rotation.
BoardAndTip refine(const Problem& problem, const Indices& used, BoardAndTip x, double sigma_m) {
  double damping = 1e-6;
  Normal now = linearise(problem, used, x, sigma_m);
  for (int step = 0; step < 60; ++step) {
    Matrix9d damped = now.h;
    damped.diagonal() *= 1 + damping;
    const Vector9d d = -damped.ldlt().solve(now.g);
    if (!d.allFinite()) return x;
    const BoardAndTip tried{perturb(x.base_T_board, d.head<6>()), x.flange_p_tip + d.tail<3>()};
    const Normal next = linearise(problem, used, tried, sigma_m);
    const bool better = next.cost() <= now.cost();
    damping = better ? damping / 10 : damping * 10;
    if (better) {
      x = tried;
      now = next;
    }
    constexpr double kSmall = 1e-10;  // m, rad: far below what any touch tells
    if (d.cwiseAbs().maxCoeff() < kSmall || damping > 1e12) break;
  }
  return x;
}

Pose horn(const Problem& problem, const Indices& used, const Eigen::Vector3d& flange_p_tip) {
  std::vector<Eigen::Vector3d> touched, points;
  for (const std::size_t i : used) {
    touched.push_back(problem.touches[i].base_T_flange * flange_p_tip);
    points.push_back(problem.points[i]);
  }
  return absolute_orientation(touched, points);
}

/// Tip and the image of the board's plane under any affine map: linear in its twelve unknowns. Where the touches do
/// not tell them all, the smallest tip that fits.
Eigen::Vector3d linear_tip(const Problem& problem, const Indices& used) {
  Eigen::MatrixXd rows(3 * static_cast<Eigen::Index>(used.size()), 12);
  Eigen::VectorXd right(rows.rows());
  for (std::size_t k = 0; k < used.size(); ++k) {
    const auto row = 3 * static_cast<Eigen::Index>(k);
    const Transform<Base, Flange>& flange = problem.touches[used[k]].base_T_flange;
    const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
    rows.middleRows<3>(row) << flange.rotation(), -one, -problem.points[used[k]].x() * one,
        -problem.points[used[k]].y() * one;
    right.segment<3>(row) = -flange.translation();
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(rows.rows(), rows.cols());
  solver.setThreshold(1e-3);
  solver.compute(rows);
  const Eigen::VectorXd solution = solver.solve(right);
  return solution.head<3>();
}

/// From the start that ends best: a tip of the flange's own, and, to be estimated, the linear one.
BoardAndTip solve(const Problem& problem, const Indices& used, double sigma_m) {
  std::vector<Eigen::Vector3d> starts;
  if (problem.tip) {
    starts.push_back(problem.tip->flange_p_tip_m);
  } else {
    starts = {linear_tip(problem, used), Eigen::Vector3d::Zero()};
  }
  BoardAndTip best;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& tip : starts) {
    const BoardAndTip x = refine(problem, used, {horn(problem, used, tip), tip}, sigma_m);
    const double cost = linearise(problem, used, x, sigma_m).cost();
    if (cost < least) {
      least = cost;
      best = x;
    }
  }
  return best;
}

Indices all_of(std::size_t count) {
  Indices all(count);
  for (std::size_t i = 0; i < count; ++i) all[i] = i;
  return all;
}

/// `count` different numbers below `below`, ascending.
Indices draw(std::size_t count, std::size_t below, Random& random) {
  Indices drawn;
  while (drawn.size() < count) {
    const auto i = static_cast<std::size_t>(random.below(static_cast<int>(below)));
    if (std::ranges::find(drawn, i) == drawn.end()) drawn.push_back(i);
  }
  std::ranges::sort(drawn);
  return drawn;
}

/// RMS distance (m) of the points from the line that fits them best.
double distance_from_line(const std::vector<Eigen::Vector3d>& points, const Indices& used) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::size_t i : used) mean += points[i] / static_cast<double>(used.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const std::size_t i : used) scatter += (points[i] - mean) * (points[i] - mean).transpose();
  const double across = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues().head<2>().sum();
  return std::sqrt(std::max(0.0, across) / static_cast<double>(used.size()));
}

struct Median {
  BoardAndTip solution;
  double residual_m = std::numeric_limits<double>::infinity();
};

/// The solution of some touches for which half of all touches are nearest to their points.
Median least_median(const Problem& problem, const TouchOptions& options, double line_m) {
  Random random(1);  // of a stream of its own: the same touches give the same draws
  Median best;
  for (int i = 0; i < kDraws; ++i) {
    const Indices drawn = draw(problem.touches_min(), problem.touches.size(), random);
    if (distance_from_line(problem.points, drawn) < line_m) continue;
    const BoardAndTip x = solve(problem, drawn, options.touch_sigma_m);
    std::vector<double> residuals;
    for (std::size_t k = 0; k < problem.touches.size(); ++k) residuals.push_back(problem.residual(k, x).norm());
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::nth_element(residuals.begin(), middle, residuals.end());
    if (*middle < best.residual_m) best = {x, *middle};
  }
  return best;
}

Indices within(const Problem& problem, const BoardAndTip& x, double limit_m) {
  Indices kept;
  for (std::size_t i = 0; i < problem.touches.size(); ++i) {
    if (problem.residual(i, x).norm() <= limit_m) kept.push_back(i);
  }
  return kept;
}

/// The touches that agree. All of them unless one stands out of the solution of all.
Indices gate_touches(const Problem& problem, const TouchOptions& options, double line_m) {
  const double expected_m = options.gate * options.touch_sigma_m;
  const Indices all = all_of(problem.touches.size());
  Indices kept = within(problem, solve(problem, all, options.touch_sigma_m), expected_m);
  if (kept.size() == all.size() || all.size() <= problem.touches_min()) return all;
  const Median start = least_median(problem, options, line_m);
  // Rousseeuw's factor for few of them: the median was made small by the choice.
  const double few = 1 + 5.0 / static_cast<double>(all.size() - problem.touches_min());
  const double coarsest_m = options.coarse_max * options.touch_sigma_m;
  double sigma_m = std::clamp(few * start.residual_m / kChi3Median, options.touch_sigma_m, coarsest_m);
  kept = within(problem, start.solution, options.gate * sigma_m);
  for (int round = 0; round < 10 && kept.size() > problem.touches_min(); ++round) {
    const BoardAndTip x = solve(problem, kept, options.touch_sigma_m);
    const double dof = 3 * static_cast<double>(kept.size()) - problem.unknowns();
    const double chi2 = linearise(problem, kept, x, options.touch_sigma_m).touch_chi2;
    sigma_m = options.touch_sigma_m * std::clamp(std::sqrt(chi2 / dof), 1.0, options.coarse_max);
    const Indices next = within(problem, x, options.gate * sigma_m);
    if (next == kept) break;
    kept = next;
  }
  return kept;
}

/// Sigmas of the tip's principal directions, in the flange, ascending; infinite where the touches tell nothing.
struct TipSigmas {
  Eigen::Vector3d sigma_m;
  Eigen::Matrix3d directions;
};

TipSigmas tip_sigmas(const Normal& n) {
  const Eigen::Matrix<double, 6, 3> mixed = n.h.topRightCorner<6, 3>();
  const Matrix6d board = n.h.topLeftCorner<6, 6>();
  const Eigen::Matrix3d information = n.h.bottomRightCorner<3, 3>() - mixed.transpose() * board.ldlt().solve(mixed);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(information);
  TipSigmas s;
  for (Eigen::Index i = 0; i < 3; ++i) {
    s.sigma_m[i] = 1 / std::sqrt(std::max(eigen.eigenvalues()[2 - i], 1e-12));
    s.directions.col(i) = eigen.eigenvectors().col(2 - i);
  }
  return s;
}

double largest_turn(std::span<const Touch> touches, const Indices& used) {
  double largest = 0;
  for (const std::size_t i : used) {
    const Eigen::Matrix3d back = touches[used.front()].base_T_flange.rotation().transpose();
    largest = std::max(largest, rotation_log(back * touches[i].base_T_flange.rotation()).norm());
  }
  return largest;
}

Status check_tip_told(const Problem& problem, const Indices& used, const Normal& n, const TouchOptions& options) {
  if (problem.tip) return {};
  const TipSigmas s = tip_sigmas(n);
  if (s.sigma_m[2] <= options.tip_sigma_max_m) return {};
  constexpr double kOneOrientation_rad = 5 / kDegrees;
  const double turn = largest_turn(problem.touches, used);
  if (turn < kOneOrientation_rad) {
    return failure(Fault::kTouchesUnusable,
                   "the flange had one orientation at all touches (within {:.1f} degrees), which leaves tip and board "
                   "open together: tilt it by 20 degrees to different sides, or give the tip's offset",
                   turn * kDegrees);
  }
  const Eigen::Vector3d d = std::copysign(1.0, s.directions.col(2).sum()) * s.directions.col(2);
  return failure(Fault::kTouchesUnusable,
                 "the touches leave the tip open along ({:.2f}, {:.2f}, {:.2f}) of the flange: tilt it by 20 degrees "
                 "about another axis, or give the tip's offset",
                 d.x() + 0.0, d.y() + 0.0, d.z() + 0.0);
}

Status check_given(const BoardSpec& board, std::span<const Touch> touches, const TouchOptions& options) {
  const std::size_t least = options.tip ? 3 : 4;
  if (touches.size() < least) {
    return failure(Fault::kTouchesUnusable, "{} touches, {} are the least{}", touches.size(), least,
                   options.tip ? "" : " when the tip's offset is to be estimated");
  }
  if (touches.size() > kTouchesMax) {
    return failure(Fault::kDataMalformed, "{} touches, {} are the most", touches.size(), kTouchesMax);
  }
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (touches[i].corner < 0 || touches[i].corner >= board.corners()) {
      return failure(Fault::kDataMalformed, "touch {}: point {} of a board with {}", i + 1, touches[i].corner,
                     board.corners());
    }
    if (!touches[i].base_T_flange.pose().matrix().allFinite()) {
      return failure(Fault::kDataMalformed, "touch {}: a pose that is not finite", i + 1);
    }
  }
  if (options.tip && !options.tip->flange_p_tip_m.allFinite()) {
    return failure(Fault::kDataMalformed, "the tip's offset is not finite");
  }
  return {};
}

/// Of a touch that was left out: the other point that it stood on, by a third of the distance of neighbours.
std::optional<int> point_touched(const BoardSpec& board, const Eigen::Vector3d& in_board, int said) {
  std::optional<int> nearest;
  double least = board.square_size_m / 3;
  for (int k = 0; k < board.corners(); ++k) {
    const double distance = (board.corner(k) - in_board).norm();
    if (k == said || distance >= least) continue;
    least = distance;
    nearest = k;
  }
  return nearest;
}

double residual_rms(const Problem& problem, const Indices& used, const BoardAndTip& x) {
  double squared = 0;
  for (const std::size_t i : used) squared += problem.residual(i, x).squaredNorm();
  return std::sqrt(squared / static_cast<double>(used.size()));
}

/// What is common to all touches: the arm's deviation, which moves the board about the flange.
Matrix6d arm_covariance(const Problem& problem, const Indices& used, const BoardAndTip& x, const ArmSigma& sigma) {
  Eigen::Vector3d flange = Eigen::Vector3d::Zero();
  for (const std::size_t i : used) flange += problem.touches[i].base_T_flange.translation();
  flange /= static_cast<double>(used.size());
  const Matrix6d by_arm = moved_by(Eigen::Matrix3d::Identity(), x.base_T_board.translation() - flange);
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(sigma.translation_m * sigma.translation_m),
      Eigen::Vector3d::Constant(sigma.rotation_rad * sigma.rotation_rad);
  return by_arm * variance.asDiagonal() * by_arm.transpose();
}

/// Of a given tip: how much worse the touches fit than with the tip that fits them best, in units of what a touch then
/// errs by.
double misfit_of_tip(const Problem& problem, const Indices& used, const BoardAndTip& given, double sigma_m) {
  if (!problem.tip) return 0;
  Problem open = problem;
  open.tip.reset();
  const double chi2 = linearise(open, used, refine(open, used, given, sigma_m), sigma_m).touch_chi2;
  const double dof = std::max(0.0, 3 * static_cast<double>(used.size()) - open.unknowns());
  const double scale = std::max(1.0, (kExpectedWorth + chi2) / (kExpectedWorth + dof));
  return std::max(0.0, linearise(problem, used, given, sigma_m).cost() - chi2) / scale;
}

void measure_scale(const Problem& problem, const Indices& used, TouchedBoard& result) {
  std::vector<Eigen::Vector3d> touched, points;
  for (const std::size_t i : used) {
    touched.push_back(problem.touches[i].base_T_flange * result.flange_p_tip_m);
    points.push_back(problem.points[i]);
  }
  result.scale = scale_between(touched, points);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  double spread = 0;
  for (const Eigen::Vector3d& p : points) spread += (p - mean).squaredNorm();
  result.scale_sigma = result.touch_sigma_m / std::sqrt(spread);
}

void describe_touches(const BoardSpec& board, const Problem& problem, const Indices& used, const BoardAndTip& x,
                      TouchedBoard& result) {
  result.fits.resize(problem.touches.size());
  const Pose board_T_base = x.base_T_board.inverse(Eigen::Isometry);
  for (std::size_t i = 0; i < problem.touches.size(); ++i) {
    TouchFit& fit = result.fits[i];
    fit.corner = problem.touches[i].corner;
    fit.name = corner_name(board, fit.corner);
    fit.used = std::ranges::binary_search(used, i);
    const Eigen::Vector3d in_board = board_T_base * (problem.touches[i].base_T_flange * x.flange_p_tip);
    fit.off_m = in_board - problem.points[i];
    if (fit.used) result.residual_max_m = std::max(result.residual_max_m, fit.off_m.norm());
    if (!fit.used) fit.rather = point_touched(board, in_board, fit.corner);
    if (fit.rather) fit.rather_name = corner_name(board, *fit.rather);
  }
}

}  // namespace

std::vector<int> corners_to_touch(const BoardSpec& board, int count) {
  std::vector<int> chosen = {0};
  while (static_cast<int>(chosen.size()) < std::min(count, board.corners())) {
    int farthest = 0;
    double most = -1;
    for (int k = 0; k < board.corners(); ++k) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const int c : chosen) nearest = std::min(nearest, (board.corner(k) - board.corner(c)).norm());
      if (nearest <= most + 1e-9) continue;  // the first of those that are equally far, whatever the rounding
      most = nearest;
      farthest = k;
    }
    chosen.push_back(farthest);
  }
  return chosen;
}

std::string corner_name(const BoardSpec& board, int corner) {
  if (board.has_marker_corners()) return fmt::format("point {}", corner);
  return fmt::format("corner ({}, {})", corner % board.inner_columns, corner / board.inner_columns);
}

Result<TouchedBoard> locate_touched_board(const BoardSpec& board, std::span<const Touch> touches,
                                          const TouchOptions& options) {
  if (const Status given = check_given(board, touches, options); !given) return std::unexpected(given.error());
  Problem problem{touches, {}, options.tip};
  for (const Touch& touch : touches) problem.points.push_back(board.corner(touch.corner));
  const double line_m = kLineShare * board.square_size_m;
  const auto on_a_line = [&](const Indices& some) { return distance_from_line(problem.points, some) < line_m; };
  if (on_a_line(all_of(touches.size()))) {
    return failure(Fault::kTouchesUnusable, "the {} touches lie on a line of the board", touches.size());
  }

  const Indices used = gate_touches(problem, options, line_m);
  const auto left_out = static_cast<double>(touches.size() - used.size());
  if (used.size() < problem.touches_min() || left_out > options.left_out_max * static_cast<double>(touches.size()) ||
      on_a_line(used)) {
    return failure(Fault::kTouchesUnusable, "the touches contradict each other: {} of {} agree", used.size(),
                   touches.size());
  }

  const BoardAndTip first = solve(problem, used, options.touch_sigma_m);
  const Normal expected = linearise(problem, used, first, options.touch_sigma_m);
  if (const Status told = check_tip_told(problem, used, expected, options); !told) {
    return std::unexpected(told.error());
  }
  TouchedBoard result;
  result.chi2 = expected.touch_chi2;
  result.degrees_of_freedom = 3 * static_cast<int>(used.size()) - problem.unknowns();
  const int dof = result.degrees_of_freedom;
  result.chi2_limit = dof > 0 ? chi_square_quantile(1 - kSignificance, dof) : 0;
  result.touch_sigma_m = options.touch_sigma_m * std::sqrt((kExpectedWorth + result.chi2) / (kExpectedWorth + dof));

  const BoardAndTip x = refine(problem, used, first, result.touch_sigma_m);
  const Normal normal = linearise(problem, used, x, result.touch_sigma_m);
  const Matrix9d covariance = normal.h.ldlt().solve(Matrix9d::Identity());
  result.base_T_board = Transform<Base, Board>(x.base_T_board);
  result.covariance = covariance.topLeftCorner<6, 6>() + arm_covariance(problem, used, x, options.arm_sigma);
  result.flange_p_tip_m = x.flange_p_tip;
  result.tip_sigma_m = covariance.diagonal().tail<3>().cwiseMax(0).cwiseSqrt();
  result.tip_estimated = !options.tip;
  result.tip_chi2 = misfit_of_tip(problem, used, first, options.touch_sigma_m);
  result.horn_residual_rms_m = residual_rms(problem, used, {horn(problem, used, x.flange_p_tip), x.flange_p_tip});
  result.residual_rms_m = residual_rms(problem, used, x);
  result.used = static_cast<int>(used.size());
  describe_touches(board, problem, used, x, result);
  measure_scale(problem, used, result);
  if (!result.covariance.allFinite()) return failure(Fault::kTouchesUnusable, "the touches do not determine the board");
  return result;
}

}  // namespace firstlook
