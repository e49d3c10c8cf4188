/// Where depth came back from outside of the map: the walls and the ceiling that rays end at beyond its grid.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/depth_rays.hpp"

namespace firstlook {

/// Coarse cells around the map in which something returned, or that rays passed which nothing returned of. Tells
/// whether a ray that leaves the map will return, as far as has been seen: towards an open sky it will not, whatever is
/// looked for on the way. Memory is taken at construction.
class FarReturns {
 public:
  /// Covers the map's box and `range_m` around it.
  FarReturns(const GridGeometry& map, double range_m);
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& map, double range_m);

  /// Learns from a frame: some thousand of its pixels, those left out that the arm's own body hides (`self_depth_m`, as
  /// render_self_depth fills it; empty: none). Programmer error when the image has another size than `camera`.
  void learn(const DepthImage& depth, const CameraIntrinsics& camera, const Transform<Base, Depth>& base_T_depth,
             std::span<const float> self_depth_m);
  /// Whether a cell outside of the map where something returned lies on the line between two points.
  [[nodiscard]] bool lies_between(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const;
  /// Whether a line leaves the map and then, up to its end, crosses no cell where something returned, and mostly (three
  /// quarters) such that were seen to be open: no two looks cross the same cells.
  [[nodiscard]] bool is_open(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const;
  [[nodiscard]] bool knows_returns() const { return knows_returns_; }
  [[nodiscard]] bool knows_openings() const { return knows_openings_; }

 private:
  static constexpr std::uint8_t kReturned = 1, kOpen = 2;
  static GridGeometry cells_around(const GridGeometry& map, double range_m);
  /// The share of a line at which it leaves the map; 1: it does not.
  [[nodiscard]] double leaves_map(const Eigen::Vector3d& from_m, const Eigen::Vector3d& way_m) const;
  void note_opening(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m);
  GridGeometry cells_;
  Eigen::Vector3d low_m_, high_m_;  ///< of the map
  std::vector<std::uint8_t> seen_;
  double range_m_;
  bool knows_returns_ = false, knows_openings_ = false;
};

}  // namespace firstlook
