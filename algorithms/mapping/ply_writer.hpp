/// Voxel centres as a binary PLY point cloud.
#pragma once

#include "algorithms/mapping/byte_sink.hpp"
#include "algorithms/mapping/map_planes.hpp"
#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// Binary little-endian PLY of the occupied voxels' centres (and of the free ones when asked): x y z (float, m),
/// red green blue (coloured by height), class (uchar: VoxelClass).
/// @param planes  of the map, or none: with colours red green blue are those, kNoColor where there is none; label
/// (ushort, 0: no object) and
///                shape (uchar: 1 plane, 2 box, 3 other, 0 no object), sensor (uchar, 0: none) follow the class
void write_ply(const VoxelMap& map, bool with_free, ByteSink sink, const MapPlanes& planes = {});

}  // namespace firstlook
