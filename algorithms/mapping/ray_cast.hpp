/// How much a view would tell: unknown voxels along the rays of a pinhole, each counted once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/voxel_map.hpp"
#include "platform/core/camera_intrinsics.hpp"

namespace firstlook {

/// Ray ends in the depth camera's frame; every ray starts at its origin. Neighbours follow each other in tiles of 4
/// x 2.
struct GainRays {
  std::vector<Eigen::Vector3d> ends_m;

  /// The thesis's 108 x 78 rays that end on a plane of 5.4296 x 3.9391 m at 5 m.
  [[nodiscard]] static GainRays thesis();
  /// A grid of columns x rays rays through the image of a pinhole (distortion ignored), each `range_max_m` long.
  [[nodiscard]] static GainRays pinhole(const CameraIntrinsics& intrinsics, int columns, int rows, double range_max_m);
};

enum class UnknownReading : std::uint8_t {
  kSeeThrough,  ///< optimistic: a ray passes unknown voxels and counts each, until an occupied one
  kStop,        ///< OctoMap's castRay with ignoreUnknown = false: a ray ends at its first unknown voxel, and counts it
};

/// One byte for each voxel tells a ray what to do: 0 passes, 1..253 is unknown with that weight, kUnknownNoWeight is
/// unknown and counts nothing, kOpaque stops.
inline constexpr std::uint8_t kGainWeightMax = 253;
inline constexpr std::uint8_t kUnknownNoWeight = 254;
inline constexpr std::uint8_t kOpaque = 255;

/// What rays meet, and how far from it they are: memory is taken at construction.
class GainPlane {
 public:
  explicit GainPlane(const GridGeometry& geometry);
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& geometry) {
    return (1 + kOctants) * geometry.count();
  }

  /// Fill it, then call prepare().
  [[nodiscard]] std::span<std::uint8_t> what() { return what_; }
  [[nodiscard]] std::span<const std::uint8_t> what() const { return what_; }
  /// Finds the room around each voxel for rays that read the unknown in this way.
  void prepare(UnknownReading reading);

  [[nodiscard]] const GridGeometry& geometry() const { return geometry_; }
  [[nodiscard]] UnknownReading reading() const { return reading_; }
  /// For rays of each octant of directions the edge of the largest cube, from the voxel on in their direction, in which
  /// none of them has anything to do; 0 where it has. All voxels for directions that go up along every axis, then those
  /// that go down along x, and so on by the bits of an octant's number.
  [[nodiscard]] std::span<const std::uint8_t> room() const { return room_; }

 private:
  static constexpr std::size_t kOctants = 8;
  static constexpr std::size_t kReadBeyond = 3;  ///< bytes are fetched as words

  GridGeometry geometry_;
  UnknownReading reading_ = UnknownReading::kStop;
  std::vector<std::uint8_t> what_, room_;
  std::vector<std::uint8_t> rows_;  ///< scratch
};

/// Fills and prepares a plane from the map: unknown voxels get their weight, free ones pass, occupied ones stop.
/// @param weights  empty (all 1), or one byte for each voxel; 0 is outside the zone of interest, at most kGainWeightMax
void build_gain_plane(const VoxelMap& map, std::span<const std::uint8_t> weights, UnknownReading reading,
                      GainPlane& plane);

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
  /// True the first time in this view that it is wanted. No branch: nobody could foresee it.
  [[nodiscard]] bool mark(std::size_t index, bool wanted = true) {
    const std::uint8_t before = epoch_of_[index];
    const bool is_new = wanted && before != epoch_;
    epoch_of_[index] = is_new ? epoch_ : before;
    return is_new;
  }
  [[nodiscard]] bool is_marked(std::size_t index) const { return epoch_of_[index] == epoch_; }

 private:
  std::vector<std::uint8_t> epoch_of_;
  std::uint8_t epoch_ = 0;
};

/// Counts the unknown voxels that a view sees; no allocation. Rays go in packets of eight from room to room in floats;
/// one of which rounding could decide the next voxel is walked voxel by voxel in doubles (Amanatides and Woo 1987).
/// @param range_min_m  along the optical axis: nearer voxels are passed or stop the ray but count nothing
/// A ray is followed inside the grid only: outside nothing counts and nothing stops. A sensor that stands outside sees
/// in.
[[nodiscard]] GainCount count_unknown(const GainPlane& plane, const GainRays& rays,
                                      const Transform<Base, Depth>& base_T_depth, double range_min_m,
                                      GainScratch& scratch);
/// The same count with every ray walked voxel by voxel: the plain way, which the packets are held against.
[[nodiscard]] GainCount count_unknown_by_walking(const GainPlane& plane, const GainRays& rays,
                                                 const Transform<Base, Depth>& base_T_depth, double range_min_m,
                                                 GainScratch& scratch);

}  // namespace firstlook
