#include "hal/sim/ray_geometry.hpp"

namespace firstlook::sim {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double ray_to_sphere_m(const Eigen::Vector3d& to_center, const Eigen::Vector3d& direction, double radius_m) {
  const double along = to_center.dot(direction);
  const double discriminant = along * along - to_center.squaredNorm() + radius_m * radius_m;
  if (discriminant < 0) return kInfinity;
  const double t = along - std::sqrt(discriminant);
  return t >= 0 ? t : kInfinity;
}

double squared_point_to_box(const Eigen::Vector3d& p, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return (low - p).cwiseMax(p - high).cwiseMax(0.0).squaredNorm();
}

}  // namespace

double ray_to_capsule_m(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction, const Capsule& capsule) {
  const Eigen::Vector3d to_a = capsule.a - origin_m;
  double nearest = std::min(ray_to_sphere_m(to_a, direction, capsule.radius_m),
                            ray_to_sphere_m(capsule.b - origin_m, direction, capsule.radius_m));
  const Eigen::Vector3d axis = capsule.b - capsule.a;
  const double length = axis.norm();
  if (length <= 0) return nearest;
  // The side: a quadratic in the plane across the axis.
  const Eigen::Vector3d u = axis / length;
  const Eigen::Vector3d across = direction - direction.dot(u) * u;
  const Eigen::Vector3d offset = to_a - to_a.dot(u) * u;
  const double a = across.squaredNorm();
  if (a < 1e-18) return nearest;
  const double b = across.dot(offset);
  const double discriminant = b * b - a * (offset.squaredNorm() - capsule.radius_m * capsule.radius_m);
  if (discriminant < 0) return nearest;
  const double t = (b - std::sqrt(discriminant)) / a;
  const double at = (t * direction - to_a).dot(u);
  if (t >= 0 && at >= 0 && at <= length) nearest = std::min(nearest, t);
  return nearest;
}

double segment_to_box_m(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& low,
                        const Eigen::Vector3d& high) {
  // The squared distance is convex and piecewise quadratic along the segment: bisect its derivative.
  const Eigen::Vector3d d = b - a;
  const auto slope = [&](double t) {
    const Eigen::Vector3d p = a + t * d;
    return d.dot((p - high).cwiseMax(0.0) - (low - p).cwiseMax(0.0));
  };
  if (slope(0) >= 0) return std::sqrt(squared_point_to_box(a, low, high));
  if (slope(1) <= 0) return std::sqrt(squared_point_to_box(b, low, high));
  double from = 0, to = 1;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (from + to);
    (slope(middle) < 0 ? from : to) = middle;
  }
  return std::sqrt(squared_point_to_box(a + 0.5 * (from + to) * d, low, high));
}

}  // namespace firstlook::sim
