#include "hal/sim/ray_geometry.hpp"

namespace firstlook::sim {
namespace {

double squared_point_to_box(const Eigen::Vector3d& p, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return (low - p).cwiseMax(p - high).cwiseMax(0.0).squaredNorm();
}

}  // namespace

double segment_to_box_m(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& low,
                        const Eigen::Vector3d& high) {
  // The squared distance is convex along the segment, and quadratic between the planes of the box's sides.
  const Eigen::Vector3d d = b - a;
  const auto slope = [&](double t) {
    const Eigen::Vector3d p = a + t * d;
    return d.dot((p - high).cwiseMax(0.0) - (low - p).cwiseMax(0.0));
  };
  double from = 0, to = 1, slope_from = slope(0), slope_to = slope(1);
  if (slope_from >= 0) return std::sqrt(squared_point_to_box(a, low, high));
  if (slope_to <= 0) return std::sqrt(squared_point_to_box(b, low, high));
  for (int axis = 0; axis < 3; ++axis) {
    for (const double plane : {low[axis], high[axis]}) {
      const double t = (plane - a[axis]) / d[axis];
      if (!(t > from && t < to)) continue;  // parallel to the plane, too
      const double slope_here = slope(t);
      (slope_here < 0 ? from : to) = t;
      (slope_here < 0 ? slope_from : slope_to) = slope_here;
    }
  }
  const double t = from + (to - from) * slope_from / (slope_from - slope_to);
  return std::sqrt(squared_point_to_box(a + t * d, low, high));
}

}  // namespace firstlook::sim
