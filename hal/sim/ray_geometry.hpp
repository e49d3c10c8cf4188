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
  Eigen::Vector3i voxel = geometry.voxel(origin_m);
  Eigen::Vector3d next_m, step_m;
  Eigen::Vector3i step;
  for (int axis = 0; axis < 3; ++axis) {
    step[axis] = direction[axis] > 0 ? 1 : -1;
    step_m[axis] = direction[axis] != 0 ? geometry.resolution_m / std::abs(direction[axis])
                                        : std::numeric_limits<double>::infinity();
    const double wall = (geometry.first[axis] + voxel[axis] + (step[axis] > 0 ? 1 : 0)) * geometry.resolution_m;
    next_m[axis] =
        direction[axis] != 0 ? (wall - origin_m[axis]) / direction[axis] : std::numeric_limits<double>::infinity();
  }
  while (geometry.contains(voxel)) {
    visit(geometry.index(voxel));
    int axis = 0;
    const double nearest_m = next_m.minCoeff(&axis);
    if (nearest_m > length_m) return;
    voxel[axis] += step[axis];
    next_m[axis] += step_m[axis];
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
  Eigen::Vector3i v;
  for (v.z() = first.z(); v.z() <= last.z(); ++v.z()) {
    for (v.y() = first.y(); v.y() <= last.y(); ++v.y()) {
      for (v.x() = first.x(); v.x() <= last.x(); ++v.x()) {
        const Eigen::Vector3d center = geometry.center_m(v);
        const Eigen::Vector3d half = Eigen::Vector3d::Constant(half_m);
        const double along = length2 > 0 ? std::clamp(axis.dot(center - capsule.a) / length2, 0.0, 1.0) : 0.0;
        const double to_center_m = (center - capsule.a - along * axis).norm();
        if (to_center_m >= reach_m + half.norm()) continue;  // beyond its corners
        if (to_center_m < reach_m + half_m ||                // within its inscribed ball
            segment_to_box_m(capsule.a, capsule.b, center - half, center + half) < reach_m) {
          visit(v);
        }
      }
    }
  }
}

}  // namespace firstlook::sim
