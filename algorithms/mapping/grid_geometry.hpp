/// Where the voxels of a dense grid lie: aligned to OctoMap's keys, so that maps can be compared voxel for voxel.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace firstlook {

/// A box of cubic voxels. Voxel (i, j, k) covers [(first + (i,j,k)) * resolution, (first + (i,j,k) + 1) * resolution):
/// OctoMap's key minus 32768 is first + (i, j, k). Index = (k * ny + j) * nx + i.
struct GridGeometry {
  double resolution_m = 0.05;
  Eigen::Vector3i first = Eigen::Vector3i::Zero();
  Eigen::Vector3i size = Eigen::Vector3i::Zero();

  /// The smallest grid that contains the box from `low_m` to `high_m`.
  [[nodiscard]] static GridGeometry covering(const Eigen::Vector3d& low_m, const Eigen::Vector3d& high_m,
                                             double resolution_m) {
    GridGeometry g;
    g.resolution_m = resolution_m;
    for (int axis = 0; axis < 3; ++axis) {
      g.first[axis] = static_cast<int>(std::floor(low_m[axis] / resolution_m + 1e-9));
      g.size[axis] = static_cast<int>(std::ceil(high_m[axis] / resolution_m - 1e-9)) - g.first[axis];
    }
    return g;
  }

  [[nodiscard]] std::size_t count() const {
    return static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(size.z());
  }
  /// Voxel coordinates of a point; may lie outside. Finite points only.
  [[nodiscard]] Eigen::Vector3i voxel(const Eigen::Vector3d& point_m) const {
    return Eigen::Vector3i(static_cast<int>(std::floor(point_m.x() / resolution_m)) - first.x(),
                           static_cast<int>(std::floor(point_m.y() / resolution_m)) - first.y(),
                           static_cast<int>(std::floor(point_m.z() / resolution_m)) - first.z());
  }
  [[nodiscard]] bool contains(const Eigen::Vector3i& v) const {
    return v.x() >= 0 && v.y() >= 0 && v.z() >= 0 && v.x() < size.x() && v.y() < size.y() && v.z() < size.z();
  }
  [[nodiscard]] std::size_t index(const Eigen::Vector3i& v) const {
    return (static_cast<std::size_t>(v.z()) * static_cast<std::size_t>(size.y()) + static_cast<std::size_t>(v.y())) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(v.x());
  }
  [[nodiscard]] Eigen::Vector3i voxel_at(std::size_t index) const {
    const auto nx = static_cast<std::size_t>(size.x());
    const auto ny = static_cast<std::size_t>(size.y());
    return {static_cast<int>(index % nx), static_cast<int>(index / nx % ny), static_cast<int>(index / (nx * ny))};
  }
  [[nodiscard]] Eigen::Vector3d center_m(const Eigen::Vector3i& v) const {
    return ((first + v).cast<double>().array() + 0.5) * resolution_m;
  }
  [[nodiscard]] bool operator==(const GridGeometry& o) const {
    return resolution_m == o.resolution_m && first == o.first && size == o.size;
  }
};

}  // namespace firstlook
