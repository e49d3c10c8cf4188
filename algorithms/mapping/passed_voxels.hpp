/// Which voxels the rays of a frame pass, asked voxel by voxel. Internal to algorithms/mapping.
#pragma once

#include <cstdint>
#include <span>

#include "algorithms/mapping/depth_rays.hpp"
#include "algorithms/mapping/range_image.hpp"

namespace firstlook {

/// Marks the same voxels as RayMarker does for every ray of a pinhole image, at a fraction of its cost: millions of
/// steps along rays become some ten thousand questions. A voxel is passed when a ray through its inscribed ball goes on
/// beyond it, and not when all rays around its footprint end before it: bounds of the image over areas tell for eight
/// voxels, or bricks of voxels, at a time. Only where both leave it open the voxel is held against the rays of its
/// footprint: their lines against its silhouette, then, where they end nearby, in the plane of slabs (Kay and Kajiya
/// 1986), with an allowance for rounding on either side. A ray between the two is walked as RayMarker walks.
/// @param image  the frame's reach, of every row
/// @param hits   voxels that hold a hit: not asked about, their mark means nothing
/// @param plane  VoxelMap::bit_words words; gets the marks
void mark_passed_voxels(const GridGeometry& geometry, const DepthRays& rays, const RangeImage& image,
                        const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                        std::span<const std::uint64_t> hits, std::span<std::uint64_t> plane);

}  // namespace firstlook
