/// Occupied space as boxes in MoveIt's `.scene` text, which drops octomaps when it saves or loads.
#pragma once

#include <string_view>
#include <vector>

#include "algorithms/mapping/byte_sink.hpp"
#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// Disjoint boxes that cover exactly the occupied voxels: each grows along x, then y, then z while it stays occupied.
[[nodiscard]] std::vector<AxisBox> merge_occupied(const VoxelMap& map);

/// The boxes as MoveIt's planning scene text (collision objects with pose, shapes, colour and subframes); base frame
/// of the map, quaternion x y z w.
void write_moveit_scene(std::span<const AxisBox> boxes, std::string_view name, ByteSink sink);

}  // namespace firstlook
