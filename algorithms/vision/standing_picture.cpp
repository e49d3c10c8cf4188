#include "algorithms/vision/standing_picture.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace firstlook {
namespace {

constexpr std::size_t kAffineMin = 8;  // 16 coordinates for 6 parameters
constexpr double kChance = 1e-4;       // what scatter alone explains so rarely is a motion

/// How the corners that two frames share went from one to the other.
struct Displacement {
  double explained = 0;  ///< sum of squares of the best whole motion, px^2
  double left = 0;       ///< of what it does not explain
  int parameters = 0;
  int coordinates = 0;
};

/// Rows of the frame's corners, and of the displacements to the same corners in the next frame.
void common_corners(const CornerSet& from, const CornerSet& to, std::vector<Eigen::Vector2d>& at,
                    std::vector<Eigen::Vector2d>& shift) {
  std::size_t j = 0;
  for (std::size_t i = 0; i < from.corners_px.size(); ++i) {
    const int id = point_of(from.ids, i);
    while (j < to.corners_px.size() && point_of(to.ids, j) < id) ++j;
    if (j == to.corners_px.size()) break;
    if (point_of(to.ids, j) != id) continue;
    at.push_back(from.corners_px[i]);
    shift.emplace_back(to.corners_px[j] - from.corners_px[i]);
  }
}

/// Least squares of shift = t + A (at - mean), or of the shift t alone.
Displacement fit_motion(const CornerSet& from, const CornerSet& to) {
  std::vector<Eigen::Vector2d> at, shift;
  common_corners(from, to, at, shift);
  Displacement d;
  if (at.empty()) return d;
  const auto n = static_cast<Eigen::Index>(at.size());
  const Eigen::Index columns = at.size() < kAffineMin ? 1 : 3;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : at) mean += p / static_cast<double>(n);
  Eigen::MatrixXd design(n, columns), moved(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    design(i, 0) = 1;
    if (columns == 3) design.block<1, 2>(i, 1) = (at[k] - mean).transpose();
    moved.row(i) = shift[k].transpose();
  }
  const Eigen::MatrixXd fitted = design * design.colPivHouseholderQr().solve(moved);
  d.explained = fitted.squaredNorm();
  d.left = (moved - fitted).squaredNorm();
  d.parameters = static_cast<int>(2 * columns);
  d.coordinates = static_cast<int>(2 * n);
  return d;
}

/// Probability of an F variate above `f`, for an even number of degrees of freedom in the numerator: the incomplete
/// beta function is a finite sum then (Abramowitz and Stegun 26.6.4).
double f_tail(double f, int numerator, int denominator) {
  const double x = denominator / (denominator + numerator * f);
  double term = 1;
  double sum = 0;
  for (int j = 0; j < numerator / 2; ++j) {
    sum += term;
    term *= (1 - x) * (denominator / 2.0 + j) / (j + 1);
  }
  return std::pow(x, denominator / 2.0) * sum;
}

}  // namespace

Result<StandingPicture> judge_standing(std::span<const CornerSet> frames, double still_px) {
  auto mean = average_corners(frames);
  if (!mean) return std::unexpected(mean.error());
  StandingPicture picture;
  picture.mean = std::move(*mean);
  std::vector<Displacement> steps;
  double left = 0;
  int freedom = 0;
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
    const Displacement d = fit_motion(frames[i], frames[i + 1]);
    if (d.coordinates <= d.parameters) continue;
    steps.push_back(d);
    left += d.left;
    freedom += d.coordinates - d.parameters;
  }
  if (steps.empty()) return picture;
  const double variance = left / freedom;  // of a displacement: twice that of a corner
  picture.scatter_px = std::sqrt(variance / 2);
  for (const Displacement& d : steps) {
    const double moved = std::sqrt(d.explained / (d.coordinates / 2.0));
    picture.moved_px = std::max(picture.moved_px, moved);
    if (!(moved > still_px)) continue;
    const double f = variance > 0 ? d.explained / d.parameters / variance : std::numeric_limits<double>::infinity();
    if (f_tail(f, d.parameters, freedom) < kChance) picture.still = false;
  }
  return picture;
}

}  // namespace firstlook
