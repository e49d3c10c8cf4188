#include "algorithms/kinematics/capsule_fit.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "algorithms/kinematics/self_collision.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSlack_m = 1e-9;  // for rounding, once the radius is known
constexpr int kCentreSteps = 200;

struct Circle {
  Vector2d centre = Vector2d::Zero();
  double radius = 0;
};

/// Nearly the smallest circle around points: steps towards the farthest one (Badoiu and Clarkson 2003), then its radius
/// as it is.
Circle enclosing(const std::vector<Vector2d>& points) {
  Vector2d low = points.front(), high = points.front();
  for (const Vector2d& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  Circle circle{(low + high) / 2, 0};
  const auto farthest = [&] {
    return *std::ranges::max_element(points, {}, [&](const Vector2d& p) { return (p - circle.centre).squaredNorm(); });
  };
  Circle best{circle.centre, (farthest() - circle.centre).norm()};
  for (int i = 1; i <= kCentreSteps; ++i) {
    circle.centre += (farthest() - circle.centre) / (i + 1);
    const double radius = (farthest() - circle.centre).norm();
    if (radius < best.radius) best = {circle.centre, radius};
  }
  return best;
}

double volume(const Capsule& c) {
  const double r = c.radius_m;
  return std::numbers::pi * r * r * ((c.b - c.a).norm() + 4 * r / 3);
}

/// The shortest capsule of a radius about a line.
Capsule along(std::span<const Vector3d> points, const Vector3d& centre, const Vector3d& axis, double radius_m,
              int link) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vector3d& p : points) {
    const double t = axis.dot(p - centre);
    const double beside2 = (p - centre - t * axis).squaredNorm();
    const double cap = std::sqrt(std::max(0.0, radius_m * radius_m - beside2));
    low = std::min(low, t + cap);
    high = std::max(high, t - cap);
  }
  if (low > high) low = high = (low + high) / 2;
  Capsule capsule{centre + low * axis, centre + high * axis, radius_m, link};
  capsule.radius_m += std::max(0.0, farthest_outside_m(capsule, points)) + kSlack_m;
  return capsule;
}

}  // namespace

double farthest_outside_m(const Capsule& capsule, std::span<const Vector3d> points) {
  double farthest = -std::numeric_limits<double>::infinity();
  for (const Vector3d& p : points) {
    farthest = std::max(farthest, segment_distance_m(p, p, capsule.a, capsule.b) - capsule.radius_m);
  }
  return farthest;
}

Capsule fit_capsule(std::span<const Vector3d> points, int link) {
  ENSURE(4051, !points.empty());
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : points) spread += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  std::vector<Vector3d> directions = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  for (int i = 0; i < 3; ++i) directions.emplace_back(axes.eigenvectors().col(i));
  Capsule best;
  double least = std::numeric_limits<double>::infinity();
  for (const Vector3d& axis : directions) {
    const Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
    std::vector<Vector2d> across;
    across.reserve(points.size());
    for (const Vector3d& p : points) across.emplace_back(u.dot(p - mean), v.dot(p - mean));
    const Circle circle = enclosing(across);
    const Vector3d centre = mean + circle.centre.x() * u + circle.centre.y() * v;
    for (const double wider : {1.0, 1.03, 1.08, 1.15, 1.25, 1.4}) {
      const Capsule capsule = along(points, centre, axis, wider * circle.radius, link);
      if (volume(capsule) >= least) continue;
      least = volume(capsule);
      best = capsule;
    }
  }
  return best;
}

}  // namespace firstlook
