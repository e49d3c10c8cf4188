/// The eighths of a voxel: where in it surfaces were hit, and through which parts of it anybody has looked.
///
/// Log-odds call a voxel free when rays pass any part of it. A surface that fills another part is then lost: rays graze
/// a panel or the far side of a column, pass beside it, and after a few frames the voxel is free. Safety rule 1
/// therefore also asks that rays have crossed every octant of the voxel since a surface was hit there.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

#include "algorithms/mapping/depth_rays.hpp"
#include "algorithms/mapping/range_image.hpp"
#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// The octant of its voxel that holds a point of base: bit 0 is the upper half along x, bit 1 along y, bit 2 along z.
[[nodiscard]] inline unsigned octant_of(const GridGeometry& geometry, const Eigen::Vector3f& point_m) {
  const double halves = 2.0 / geometry.resolution_m;
  unsigned octant = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto half = static_cast<std::int64_t>(std::floor(halves * static_cast<double>(point_m[axis])));
    octant |= static_cast<unsigned>(half & 1) << axis;
  }
  return octant;
}

/// After a frame was applied: in the voxels that it passed and did not hit, notes each octant that the ray of the pixel
/// at its middle crosses wholly. Where pixels are too coarse for that, octants stay as they were.
/// @param missed, hit  the planes of VoxelMap::apply
/// @param image        the frame's reach, of every row
/// @param pinhole      the sensor's lens does not distort (DepthRays::is_pinhole)
void note_crossed_octants(VoxelMap& map, std::span<const std::uint64_t> missed, std::span<const std::uint64_t> hit,
                          const RangeImage& image, const DepthSensor& sensor, bool pinhole,
                          const Transform<Base, Depth>& base_T_depth);

}  // namespace firstlook
