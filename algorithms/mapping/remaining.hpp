/// What stays unknown: clusters of unknown voxels that touch free space.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

struct UnknownCluster {
  std::size_t voxels = 0;
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();  ///< mean of the voxel centres
  AxisBox box;
  std::vector<std::uint32_t> frontier;  ///< indices of its voxels that touch free space, ascending
};

/// Clusters of face-connected unknown voxels inside the zone of which at least one shares a face with a free voxel;
/// largest first, equal ones by their first voxel.
/// @param zone        one byte for each voxel, 0 is outside; empty is everything
/// @param voxels_min  smaller clusters are left out
[[nodiscard]] std::vector<UnknownCluster> find_remaining(const VoxelMap& map, std::span<const std::uint8_t> zone,
                                                         std::size_t voxels_min);

/// The voxels of all smaller clusters than those, whether they touch free space or not.
[[nodiscard]] std::vector<std::uint32_t> find_specks(const VoxelMap& map, std::span<const std::uint8_t> zone,
                                                     std::size_t voxels_min);

}  // namespace firstlook
