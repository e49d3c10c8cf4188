/// Maps from `.bt` and `.ot` files.
#pragma once

#include <cstdint>
#include <filesystem>

#include "algorithms/mapping/map_planes.hpp"
#include "algorithms/mapping/octree_reader.hpp"
#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// Reads a file into a grid that is fitted to it, log-odds only.
/// @return kDataMissing; kMapUnreadable with the byte; kMapTooLarge with the numbers of a grid above `voxels_max`
[[nodiscard]] Result<VoxelMap> read_map_file(const std::filesystem::path& file, std::size_t voxels_max);

/// A file's map in another map's grid.
struct MapInGrid {
  VoxelMap map;
  std::uint64_t voxels_outside = 0;  ///< known voxels of the file, of its own size, that the grid leaves out
};

/// Reads the part of a file that lies in a grid. The grid's voxels must be those of the file, or 2, 4, 8 .. of them.
/// @return as above; kMapUnreadable with both resolutions, or both boxes when nothing of the file lies in the grid
[[nodiscard]] Result<MapInGrid> read_map_file_into(const std::filesystem::path& file, const GridGeometry& geometry);

/// The planes in the map.ply beside a stored map, as write_map_files leaves it; none where there is no such file, or
/// one without planes. @return kMapUnreadable
[[nodiscard]] Result<MapPlanes> read_planes_beside(const std::filesystem::path& file, const GridGeometry& geometry);

}  // namespace firstlook
