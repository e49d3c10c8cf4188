/// Boxes around voxels, and what shape the voxels in them have.
#pragma once

#include <span>

#include "algorithms/mapping/objects.hpp"

namespace firstlook {

/// The box of one object: along base, turned about z, or tilted along its principal axes, the plainest one that no
/// other beats clearly in volume. @param centers_m  of its voxels, at least one
[[nodiscard]] OrientedBox fit_box(std::span<const Eigen::Vector3d> centers_m, double resolution_m);

/// Whether the voxels are a plane, a box or something else. @param map  says what inside the box is free
[[nodiscard]] ObjectShape shape_of(std::span<const Eigen::Vector3d> centers_m, const OrientedBox& box,
                                   const VoxelMap& map);

}  // namespace firstlook
