/// Floor, walls, ceiling, or the table of a small scene: planes that join everything that stands on them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// The planes that bound a scene: large ones with nearly all other occupied voxels on one side, the side from which
/// they were seen (free voxels before them). A box's faces are seen from the other side and stay with the box.
/// @param occupied  indices of the occupied voxels, ascending
/// @return for each of them the number of its plane from 1 on, or 0
[[nodiscard]] std::vector<std::uint8_t> find_room_planes(const VoxelMap& map, std::span<const std::size_t> occupied);

}  // namespace firstlook
