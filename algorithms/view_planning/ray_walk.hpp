/// The voxels that a straight line passes, one after the other.
#pragma once

#include <cmath>
#include <limits>

#include "algorithms/mapping/grid_geometry.hpp"

namespace firstlook {

/// Calls visit(index, entry) for each voxel of the grid that the segment from `from_m` to `to_m` passes, in order,
/// until it returns false; entry in [0, 1] is where the segment enters the voxel. Voxels outside the grid are passed
/// silently. Amanatides and Woo 1987, "A fast voxel traversal algorithm for ray tracing".
template <typename Visit>
void walk_ray(const GridGeometry& geometry, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m, Visit&& visit) {
  const Eigen::Vector3d delta = to_m - from_m;
  Eigen::Vector3i v = geometry.voxel(from_m);
  const Eigen::Vector3i last = geometry.voxel(to_m);
  Eigen::Vector3i step = Eigen::Vector3i::Zero();
  Eigen::Vector3d next = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d width = next;
  for (int axis = 0; axis < 3; ++axis) {
    if (delta[axis] == 0) continue;
    step[axis] = delta[axis] > 0 ? 1 : -1;
    const int wall = geometry.first[axis] + v[axis] + (step[axis] > 0 ? 1 : 0);
    next[axis] = (wall * geometry.resolution_m - from_m[axis]) / delta[axis];
    width[axis] = geometry.resolution_m / std::abs(delta[axis]);
  }
  double entry = 0;
  for (int steps = (last - v).cwiseAbs().sum(); steps >= 0; --steps) {
    if (geometry.contains(v) && !visit(geometry.index(v), entry)) return;
    int axis = 0;
    next.minCoeff(&axis);
    entry = next[axis];
    v[axis] += step[axis];
    next[axis] += width[axis];
  }
}

}  // namespace firstlook
