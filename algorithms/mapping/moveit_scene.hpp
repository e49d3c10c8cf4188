/// Occupied space as boxes in MoveIt's `.scene` text, which drops octomaps when it saves or loads.
#pragma once

#include <string_view>
#include <vector>

#include "algorithms/mapping/byte_sink.hpp"
#include "algorithms/mapping/class_reading.hpp"
#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// Disjoint boxes that cover exactly the voxels read as occupied (collision_class for planning): each grows along x,
/// then y, then z while it stays occupied.
[[nodiscard]] std::vector<AxisBox> merge_occupied(const VoxelMap& map, ClassReading reading);

/// The boxes as one collision object "map" in MoveIt's planning scene text: name, object, its pose, number of shapes;
/// for each type, sizes, pose, colour; number of subframes; a full stop. As PlanningScene::loadGeometryFromStream reads
/// it in MoveIt 1 from Noetic on and in MoveIt 2 (Melodic's has no pose of the object); quaternions x y z w, metres.
/// @param name  the first line, free text: the only place for a remark
void write_moveit_scene(std::span<const AxisBox> boxes, std::string_view name, ByteSink sink);

}  // namespace firstlook
