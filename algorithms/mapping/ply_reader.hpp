/// The planes of a map back from the PLY that write_ply has left; the map itself is in the octree beside it.
#pragma once

#include "algorithms/mapping/byte_source.hpp"
#include "algorithms/mapping/map_planes.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Reads the planes that a PLY of write_ply holds into a grid; points outside of it are left out.
/// @return kMapUnreadable with what is wrong: no PLY of ours, voxels of another size than the grid's, an end too early
[[nodiscard]] Result<MapPlanes> read_ply_planes(ByteSource source, const GridGeometry& geometry);

}  // namespace firstlook
