/// Where in a voxel surfaces were hit, to the eighth of a voxel, and when such a place is found empty again.
///
/// Log-odds alone lose a surface that fills only a part of its voxels: rays that graze it pass the rest of the voxel,
/// end elsewhere, and after a few frames the voxel is free. Safety rule 1 therefore also asks that no octant with a hit
/// is left which nobody has looked through since.
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

/// After a frame was applied: in the voxels that it passed and did not hit, forgets the surface of each octant that the
/// ray of the pixel at its middle crosses wholly. Where pixels are too coarse for that, octants keep their surface.
/// @param missed, hit  the planes of VoxelMap::apply
/// @param image        the frame's reach, of every row
void clear_passed_octants(VoxelMap& map, std::span<const std::uint64_t> missed, std::span<const std::uint64_t> hit,
                          const RangeImage& image, const DepthSensor& sensor,
                          const Transform<Base, Depth>& base_T_depth);

}  // namespace firstlook
