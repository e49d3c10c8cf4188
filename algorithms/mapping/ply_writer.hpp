/// Voxel centres as a binary PLY point cloud.
#pragma once

#include "algorithms/mapping/byte_sink.hpp"
#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// Binary little-endian PLY of the occupied voxels' centres (and of the free ones when asked): x y z (float, m),
/// red green blue (coloured by height), class (uchar: VoxelClass).
void write_ply(const VoxelMap& map, bool with_free, ByteSink sink);

}  // namespace firstlook
