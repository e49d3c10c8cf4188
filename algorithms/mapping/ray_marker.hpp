/// OctoMap's ray walk into bit planes of a dense grid. Internal to algorithms/mapping.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "algorithms/mapping/grid_geometry.hpp"

namespace firstlook {

/// Marks the voxels that rays from one origin pass: the same voxels as OcTree::computeRayKeys (Amanatides and Woo 1987,
/// in OctoMap's mix of float and double), clipped to the grid. Made anew for each frame; allocates nothing.
class RayMarker {
 public:
  /// @param origin_m  within OctoMap's bounds (32768 voxels from zero)
  /// @param plane     VoxelMap::bit_words words
  RayMarker(const GridGeometry& geometry, const Eigen::Vector3f& origin_m, std::span<std::uint64_t> plane);

  /// Marks every voxel from the origin's to the one before that of `end_m`; none when both are one voxel.
  void mark_passed(const Eigen::Vector3f& end_m);

  /// The same for several ends, four rays side by side.
  void mark_all_passed(std::span<const Eigen::Vector3f> ends_m);

  /// Whether mark_passed() would mark this voxel (relative to the grid); marks nothing.
  [[nodiscard]] bool passes(const Eigen::Vector3f& end_m, const Eigen::Vector3i& voxel) const;

 private:
  /// One ray of the walk. Packed coordinates hold three fields of 21 bits, biased so that none is negative.
  struct Walk {
    std::array<double, 3> next{};   ///< distance from the origin to the next boundary of each axis
    std::array<double, 3> delta{};  ///< distance between two boundaries of each axis
    std::array<std::int64_t, 3> index_step{};
    std::array<std::uint64_t, 3> packed_step{};
    double length = 0;
    int steps = 0;  ///< to the end's voxel
    std::uint64_t packed_end = 0;
    std::int64_t index_end = 0;
  };

  [[nodiscard]] Walk start(const Eigen::Vector3f& end_m, const Eigen::Vector3i& end) const;
  template <bool kClip>
  void walk(Walk w);
  void walk_together(std::span<const Walk> walks);
  [[nodiscard]] std::int64_t index_of(const Eigen::Vector3i& v) const;
  [[nodiscard]] bool in_grid(std::uint64_t packed) const;

  GridGeometry geometry_;
  std::span<std::uint64_t> plane_;
  Eigen::Vector3f origin_m_;
  Eigen::Vector3i origin_;                   ///< voxel of the origin, relative to the grid; may lie outside
  Eigen::Vector3d to_lower_m_, to_upper_m_;  ///< from the origin to the boundaries of its voxel
  std::int64_t origin_index_ = 0;
  std::uint64_t packed_origin_ = 0;
  std::uint64_t over_low_ = 0, over_high_ = 0;  ///< addends that carry into the guard bits
  bool origin_inside_ = false;
};

/// The voxel of a point relative to the grid, as OctoMap computes keys: floor(coordinate * (1 / resolution)).
[[nodiscard]] inline Eigen::Vector3i octomap_voxel(const GridGeometry& geometry, const Eigen::Vector3f& point_m) {
  const double factor = 1.0 / geometry.resolution_m;
  Eigen::Vector3i voxel;
  for (int axis = 0; axis < 3; ++axis)
    voxel[axis] = static_cast<int>(std::floor(factor * static_cast<double>(point_m[axis]))) - geometry.first[axis];
  return voxel;
}

}  // namespace firstlook
