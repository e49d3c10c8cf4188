/// Distance from any point to the nearest voxel that is not free, as a lower bound that motion can rely on.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/grid_geometry.hpp"

namespace firstlook {

/// Exact Euclidean distances between voxel centres, in base coordinates. Squares add up axis by axis (Saito and
/// Toriwaki 1994); what an update does not change is not computed again. Everything outside the grid counts as not
/// free, and everything inside before the first update. Memory is taken at construction; assignment between fields of
/// one geometry allocates nothing.
class DistanceField {
 public:
  /// Distances end here, in voxels: their squares and one more stay within 16 bits.
  static constexpr int kReachMax = 180;

  /// @param distance_max_m  larger distances are cut to it, and to kReachMax voxels
  DistanceField(const GridGeometry& geometry, double distance_max_m);
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& geometry);

  /// Follows a change of the free space, at the cost of the rows along x that lie within the maximum distance of one
  /// that changed.
  /// @param free_mask  geometry().count() bytes, not zero where free (VoxelMap::free_mask)
  /// @return rows whose distances were computed again
  std::size_t update(std::span<const std::uint8_t> free_mask);

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
  void follow_mask(std::span<const std::uint8_t> free_mask);
  void add_axis_y();
  std::size_t add_axis_z();
  /// Whether any row from `first` on, `count` of them `stride` apart and around number `middle`, is marked.
  [[nodiscard]] bool any_near(const std::vector<std::uint8_t>& rows, std::size_t first, std::size_t stride, int middle,
                              int count) const;

  GridGeometry geometry_;
  double distance_max_m_ = 0;
  double per_m_ = 0;                         ///< 1 / resolution
  int reach_ = 0;                            ///< voxels; squares are cut to its square
  std::vector<std::uint8_t> free_;           ///< the mask that the field follows
  std::vector<std::uint16_t> along_x_;       ///< voxels²: to the nearest voxel that is not free in the same row,
  std::vector<std::uint16_t> within_layer_;  ///< and in the same layer of z
  std::vector<float> values_;
  std::vector<std::uint8_t> row_changed_;    ///< rows along x (y + z * ny) that this update changed: along_x_,
  std::vector<std::uint8_t> layer_changed_;  ///< within_layer_
  std::vector<std::uint16_t> scratch_;       ///< one row
};

}  // namespace firstlook
