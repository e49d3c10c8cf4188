/// Rays and capsules against voxels, for grading: written apart from what the program itself uses.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/mapping/grid_geometry.hpp"

namespace firstlook::sim {

/// Calls visit(index) for each voxel of the grid that the ray passes within `length_m`, the last one included
/// (Amanatides and Woo 1987). `direction` is a unit vector; the origin must lie in the grid, else nothing is visited.
template <typename Visit>
void walk_ray(const GridGeometry& geometry, const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
              double length_m, Visit visit) {
  const Eigen::Vector3i voxel = geometry.voxel(origin_m);
  if (!geometry.contains(voxel)) return;
  const std::ptrdiff_t row = geometry.size.x(), layer = row * geometry.size.y();
  const std::ptrdiff_t strides[3] = {1, row, layer};
  auto index = static_cast<std::ptrdiff_t>(geometry.index(voxel));
  double next_m[3], step_m[3];  // plain arrays: the compiler keeps them in registers
  std::ptrdiff_t step[3];
  int left[3];  // voxels between this one and the grid's face ahead
  for (int axis = 0; axis < 3; ++axis) {
    const bool up = direction[axis] > 0, flat = direction[axis] == 0;
    step[axis] = up ? strides[axis] : -strides[axis];
    left[axis] = up ? geometry.size[axis] - 1 - voxel[axis] : voxel[axis];
    const double wall = (geometry.first[axis] + voxel[axis] + (up ? 1 : 0)) * geometry.resolution_m;
    constexpr double kNever_m = std::numeric_limits<double>::infinity();
    step_m[axis] = flat ? kNever_m : geometry.resolution_m / std::abs(direction[axis]);
    next_m[axis] = flat ? kNever_m : (wall - origin_m[axis]) / direction[axis];
  }
  const auto advance = [&](int axis) {
    index += step[axis];
    next_m[axis] += step_m[axis];
    return left[axis]-- > 0;
  };
  bool inside = true;
  while (inside) {
    visit(static_cast<std::size_t>(index));
    const bool x = next_m[0] <= next_m[1] && next_m[0] <= next_m[2], y = next_m[1] <= next_m[2];
    const double nearest_m = x ? next_m[0] : y ? next_m[1] : next_m[2];
    if (nearest_m > length_m) return;
    inside = x ? advance(0) : y ? advance(1) : advance(2);
  }
}

/// Distance between a segment and an axis-aligned box; 0 when they meet.
[[nodiscard]] double segment_to_box_m(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& low,
                                      const Eigen::Vector3d& high);

/// Calls visit(v) with the coordinates of each voxel, of the grid or beyond it, whose box the capsule overlaps by more
/// than `tolerance_m`.
template <typename Visit>
void walk_capsule(const GridGeometry& geometry, const Capsule& capsule, double tolerance_m, Visit visit) {
  const double reach_m = capsule.radius_m - tolerance_m;
  if (reach_m <= 0) return;
  const Eigen::Vector3i first = geometry.voxel(capsule.a.cwiseMin(capsule.b).array() - reach_m);
  const Eigen::Vector3i last = geometry.voxel(capsule.a.cwiseMax(capsule.b).array() + reach_m);
  const double half_m = 0.5 * geometry.resolution_m;
  const Eigen::Vector3d axis = capsule.b - capsule.a;
  const double length2 = axis.squaredNorm();
  const double per_length2 = length2 > 0 ? 1 / length2 : 0;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(half_m);
  const auto squared = [](double x) { return x * x; };
  const double beyond_m2 = squared(reach_m + half.norm()), within_m2 = squared(reach_m + half_m);
  Eigen::Vector3i v;
  for (v.z() = first.z(); v.z() <= last.z(); ++v.z()) {
    for (v.y() = first.y(); v.y() <= last.y(); ++v.y()) {
      for (v.x() = first.x(); v.x() <= last.x(); ++v.x()) {
        const Eigen::Vector3d center = geometry.center_m(v);
        const Eigen::Vector3d from_a = center - capsule.a;
        const double along = std::clamp(axis.dot(from_a) * per_length2, 0.0, 1.0);
        const double to_center_m2 = (from_a - along * axis).squaredNorm();
        if (to_center_m2 >= beyond_m2) continue;  // beyond its corners
        if (to_center_m2 < within_m2 ||           // within its inscribed ball
            segment_to_box_m(capsule.a, capsule.b, center - half, center + half) < reach_m) {
          visit(v);
        }
      }
    }
  }
}

}  // namespace firstlook::sim
