/// From a depth frame to the map: exactly OctoMap's insertPointCloud(points, origin, maxrange, discretize).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/mapping/depth_rays.hpp"
#include "algorithms/mapping/end_octants.hpp"
#include "algorithms/mapping/range_image.hpp"
#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

struct InsertionResult : PixelCounts {
  FrameChange change;
};

/// Which rays a frame has.
enum class RayEnds : std::uint8_t {
  kPixels,        ///< one ray for each pixel with a return
  kVoxelCenters,  ///< discretize = true: one to the centre of each voxel that holds a return; fewer and coarser
};

/// A level floor in base coordinates. What is seen within the tolerance of it clears the way there and marks nothing
/// (the thesis's ground plane, appendix B): the map keeps no floor that a planner must avoid. Whoever moves by such a
/// map must block what lies below the tolerance: rays that graze the floor clear its voxels.
struct GroundPlane {
  double height_m = 0;
  double tolerance_m = 0;
  [[nodiscard]] double top_m() const { return height_m + tolerance_m; }
};

/// Holds the scratch memory for frames of one sensor into maps of one geometry; all of it is taken at construction.
class Inserter {
 public:
  Inserter(const GridGeometry& geometry, const DepthSensor& sensor, RayEnds ends = RayEnds::kPixels);
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& geometry, const DepthSensor& sensor,
                                                  RayEnds ends = RayEnds::kPixels);

  /// Updates `map` with one frame. Each pixel with a return gives a point; voxels that its ray passes are missed, the
  /// end voxel is hit, occupied wins, one update for each voxel. Beyond min(range_max_m, range_trusted_m) the ray
  /// clears up to that range and marks nothing. Rays are clipped to the grid.
  /// @param self_depth_m  empty, or for each pixel the depth at which the arm's own body begins (render_self_depth)
  /// @return kFrameRefused for a wrong size, scale, stamp or pose; the map is then unchanged.
  [[nodiscard]] Result<InsertionResult> insert(VoxelMap& map, const DepthImage& depth,
                                               const Transform<Base, Depth>& base_T_depth,
                                               std::span<const float> self_depth_m, double stamp_s);

  /// From now on; for one ray for each pixel only.
  void set_ground(const GroundPlane& ground);

  [[nodiscard]] const DepthSensor& sensor() const { return sensor_; }
  /// The voxels that the last frame missed and hit, as VoxelMap::apply had them.
  [[nodiscard]] std::span<const std::uint64_t> missed() const { return missed_; }
  [[nodiscard]] std::span<const std::uint64_t> hit() const { return hit_; }

 private:
  [[nodiscard]] Status check_place(const Transform<Base, Depth>& base_T_depth, double stamp_s) const;
  void mark_hit(VoxelMap& map, std::int32_t octant);
  /// Takes the hits on the floor out of the row.
  void drop_ground(const RayRow& row);
  /// The row's reach, and its hits.
  void note_row(VoxelMap& map, int v, const RayRow& row);
  /// Two ways to the same marks: along every ray of any image, or by the voxels of a pinhole image (much faster).
  void mark_by_rays(VoxelMap& map, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                    std::span<const float> self_depth_m, PixelCounts& counts);
  void mark_by_voxels(VoxelMap& map, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                      std::span<const float> self_depth_m, PixelCounts& counts);
  void mark_discretized(VoxelMap& map, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                        std::span<const float> self_depth_m, PixelCounts& counts);
  class DistinctEnds;

  GridGeometry geometry_;
  DepthSensor sensor_;
  RayEnds ends_;
  double range_m_ = 0;  ///< where rays are cut: min(range_max_m, range_trusted_m)
  DepthRays rays_;      ///< of voxel centres: not cut, because the centres decide
  EndOctants end_octants_;
  RangeImage image_;
  std::optional<GroundPlane> ground_;
  std::vector<float> row_reach_m_;
  std::vector<std::int32_t> row_octant_;  ///< 8 * voxel + octant of each end; -1 outside the grid
  std::vector<std::uint64_t> missed_;
  std::vector<std::uint64_t> hit_;
  std::vector<std::uint64_t> beyond_;  ///< voxels of returns beyond the range; of voxel centres only
};

}  // namespace firstlook
