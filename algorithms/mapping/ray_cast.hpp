/// How much a view would tell: unknown voxels along the rays of a pinhole, each counted once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/voxel_map.hpp"
#include "platform/core/camera_intrinsics.hpp"

namespace firstlook {

/// Ray ends in the depth camera's frame; every ray starts at its origin.
struct GainRays {
  std::vector<Eigen::Vector3d> ends_m;

  /// The thesis's 108 x 78 rays that end on a plane of 5.4296 x 3.9391 m at 5 m.
  [[nodiscard]] static GainRays thesis();
  /// A grid of columns x rays rays through the image of a pinhole (distortion ignored), each `range_max_m` long.
  [[nodiscard]] static GainRays pinhole(const CameraIntrinsics& intrinsics, int columns, int rows, double range_max_m);
};

/// One byte for each voxel tells a ray what to do: 0 passes, 1..253 is unknown with that weight, kUnknownNoWeight is
/// unknown and counts nothing, kOpaque stops.
using GainPlane = std::vector<std::uint8_t>;
inline constexpr std::uint8_t kGainWeightMax = 253;
inline constexpr std::uint8_t kUnknownNoWeight = 254;
inline constexpr std::uint8_t kOpaque = 255;

/// Fills a plane from the map: unknown voxels get their weight, free ones pass, occupied ones stop.
/// @param weights  empty (all 1), or one byte for each voxel; 0 is outside the zone of interest, at most kGainWeightMax
/// @param plane    map.size() bytes
void build_gain_plane(const VoxelMap& map, std::span<const std::uint8_t> weights, std::span<std::uint8_t> plane);

/// What a view would see.
struct GainCount {
  std::uint32_t voxels = 0;  ///< unknown voxels with a weight, each once
  std::uint64_t weight = 0;  ///< sum of their weights
};

/// Marks of voxels already counted in one view; one for each worker. Memory is taken at construction.
class GainScratch {
 public:
  explicit GainScratch(const GridGeometry& geometry);

  /// Starts a new view: nothing is marked.
  void begin();
  /// True the first time in this view.
  [[nodiscard]] bool mark(std::size_t index) {
    if (epoch_of_[index] == epoch_) return false;
    epoch_of_[index] = epoch_;
    return true;
  }

 private:
  std::vector<std::uint8_t> epoch_of_;
  std::uint8_t epoch_ = 0;
};

enum class UnknownReading : std::uint8_t {
  kSeeThrough,  ///< optimistic: a ray passes unknown voxels and counts each, until an occupied one
  kStop,        ///< OctoMap's castRay with ignoreUnknown = false: a ray ends at its first unknown voxel, and counts it
};

/// Counts the unknown voxels that a view sees: no allocation, about 1 ms for 8424 rays at 5 cm.
/// @param plane        build_gain_plane's, geometry.count() bytes
/// @param range_min_m  along the optical axis: nearer voxels are passed or stop the ray but count nothing
/// A ray is followed inside the grid only: outside nothing counts and nothing stops. A sensor that stands outside sees
/// in.
[[nodiscard]] GainCount count_unknown(const GridGeometry& geometry, std::span<const std::uint8_t> plane,
                                      const GainRays& rays, const Transform<Base, Depth>& base_T_depth,
                                      double range_min_m, UnknownReading reading, GainScratch& scratch);

}  // namespace firstlook
