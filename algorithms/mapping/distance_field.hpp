/// Distance from any point to the nearest voxel that is not free, as a lower bound that motion can rely on.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/grid_geometry.hpp"

namespace firstlook {

/// Exact Euclidean distances between voxel centres (Meijster, Roerdink and Hesselink 2000), in base coordinates.
/// Everything outside the grid counts as not free. Memory is taken at construction; assignment between fields of one
/// geometry allocates nothing.
class DistanceField {
 public:
  /// @param distance_max_m  larger distances are cut to it
  DistanceField(const GridGeometry& geometry, double distance_max_m);
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& geometry);

  /// @param free_mask  geometry().count() bytes, not zero where free (VoxelMap::free_mask)
  void rebuild(std::span<const std::uint8_t> free_mask);

  /// A lower bound of the distance from a point to the nearest centre of a voxel that is not free; 0 outside the grid.
  /// The voxel itself may reach half a diagonal nearer. Continuous in the point. For trilinear weights w of the eight
  /// centres c around p, and every q: |p - q|² = sum w |c - q|² - sum w |c - p|²; so d(p)² >= sum w d(c)² - sum w |c -
  /// p|².
  [[nodiscard]] double distance_m(const Eigen::Vector3d& point_m) const;

  [[nodiscard]] const GridGeometry& geometry() const { return geometry_; }
  [[nodiscard]] double distance_max_m() const { return distance_max_m_; }
  /// Distance at each voxel's centre; 0 where not free.
  [[nodiscard]] std::span<const float> values() const { return values_; }

 private:
  void scan_rows(std::span<const std::uint8_t> free_mask);
  void scan_lines(int axis);

  GridGeometry geometry_;
  double distance_max_m_ = 0;
  double per_m_ = 0;                   ///< 1 / resolution
  std::vector<std::int32_t> squared_;  ///< voxels²
  std::vector<float> values_;
  std::vector<std::int32_t> line_, site_, start_;  ///< scratch of one line
};

}  // namespace firstlook
