/// The part of the map that matters for moving: all that any point of the body can reach.
#pragma once

#include <cstdint>
#include <span>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/mapping/grid_geometry.hpp"

namespace firstlook {

/// An upper bound of the distance from the shoulder (the origin of link frame 1) to any point of `body`: the lengths of
/// the links in one line, and the farthest capsule point of each link. 1.1 m and the tool for a UR5.
[[nodiscard]] double reach_m(const ArmModel& arm, const Capsules& body);

/// Marks with 1 the voxels whose centre lies within `reach_m(arm, body) + margin_m` of the shoulder and above
/// `floor_m`, with 0 all others; returns how many are marked.
/// @param body      all capsules: arm, camera, gripper
/// @param margin_m  stopping distance, and half a voxel diagonal to touch every voxel that is reached in part
std::size_t mark_reach_zone(const GridGeometry& geometry, const ArmModel& arm, const Capsules& body, double margin_m,
                            double floor_m, std::span<std::uint8_t> zone);

}  // namespace firstlook
