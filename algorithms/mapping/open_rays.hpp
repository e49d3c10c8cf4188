/// Pixels without a return that may be taken for open space (safety rule 9, `map.holes: clear_when_corroborated`).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/depth_rays.hpp"
#include "algorithms/mapping/range_image.hpp"
#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

struct OpenRaysResult {
  std::uint32_t pixels_open = 0;     ///< taken for open space
  std::uint32_t pixels_flanked = 0;  ///< between returns: something dark may stand there
  std::size_t voxels_cleared = 0;    ///< seen free because of them, with those of an earlier pose
};

/// What was marked by the frame itself: VoxelMap::apply's planes.
struct FrameMarks {
  std::span<const std::uint64_t> missed, hit;
};

/// No return is also what an object nearer than the sensor's minimum, one that is dark, one in the shadow of the
/// projector, and a pixel that was dropped look like. A ray without a return counts as open up to the trusted range
/// only when all of this holds:
/// - Of the nearest returns to its left, right, above and below, one at least lies at the end of the sensor's range
///   (the rim where open space fades out) and none is nearer: what stands before something that returns is never open.
/// - Up to the sensor's minimum range the ray, and the way of the projector's light to it, is known free.
/// - No return of the frame shades it from the projector.
/// A voxel is cleared when such rays of two different poses pass it, it was never occupied, and no hole that returns
/// flank on both sides was ever seen through it. What returns nothing from anywhere and is never seen against something
/// that does cannot be told from open space: so the policy is off by default.
/// All memory is taken at construction.
class OpenRays {
 public:
  OpenRays(const GridGeometry& geometry, const DepthSensor& sensor);
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& geometry, const DepthSensor& sensor);

  /// Looks at a frame as the sensor gave it, before anything is left out of it.
  /// @param self_depth_m  as for the insertion
  void look(const DepthImage& depth, std::span<const float> self_depth_m);
  /// Clears with that frame, after Inserter::insert() took it. The map must have Planes::kWithOpenRays.
  OpenRaysResult clear(VoxelMap& map, const Transform<Base, Depth>& base_T_depth, const FrameMarks& marks,
                       double stamp_s, double free_max_age_s);

 private:
  /// What a pixel shows; kFading: a surface at the end of the sensor's range.
  enum class Shows : std::uint8_t { kNothing, kFading, kSurface };
  struct Frame {
    const VoxelMap& map;
    const Transform<Base, Depth>& base_T_depth;
    double now_s, free_max_age_s;
  };
  [[nodiscard]] std::size_t at(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(sensor_.intrinsics.width) +
           static_cast<std::size_t>(u);
  }
  void look_at_pixels(const DepthImage& depth, std::span<const float> self_depth_m);
  void look_around();
  void look_for_shade(const DepthImage& depth, std::span<const float> self_depth_m);
  [[nodiscard]] bool is_near_part_free(const Frame& frame, int u, int v) const;
  [[nodiscard]] bool is_flanked(int u, int v) const;
  void open_block(const Frame& frame, int u, int v);

  GridGeometry geometry_;
  DepthRays rays_;
  DepthSensor sensor_;
  double range_m_;
  int stride_;  ///< pixels from one walked ray to the next: closer than half a voxel at the trusted range
  std::vector<Shows> shows_;
  std::vector<std::uint8_t> around_;  ///< what the nearest returns in four directions are: two bits each
  std::vector<std::uint8_t> open_;
  RangeImage reach_;
  std::vector<float> row_reach_m_;
  std::vector<std::uint64_t> passed_, suspect_;
};

}  // namespace firstlook
