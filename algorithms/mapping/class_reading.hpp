/// How an exporter reads the class of a voxel: as OctoMap has it, or as a collision map must.
#pragma once

#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

using ClassReading = VoxelClass (*)(const VoxelMap& map, std::size_t index);

/// OctoMap's classes, by log-odds alone.
[[nodiscard]] inline VoxelClass octomap_class(const VoxelMap& map, std::size_t index) { return map.voxel_class(index); }

/// Occupied also where log-odds have become free although a surface is left that no ray has crossed: a thin panel seen
/// edge-on fills so little of its voxels that most rays miss it, and a collision map must not have holes there.
[[nodiscard]] inline VoxelClass collision_class(const VoxelMap& map, std::size_t index) {
  return map.holds_surface(index) ? VoxelClass::kOccupied : map.voxel_class(index);
}

}  // namespace firstlook
