/// OctoMap beside our map: the same frames into OcTree::insertPointCloud, compared voxel for voxel.
#pragma once

#include <octomap/octomap.h>

#include <cmath>

#include "algorithms/mapping/voxel_map.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/image_view.hpp"

namespace firstlook {

inline octomap::point3d to_octomap(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

/// The returns of an undistorted frame in base coordinates.
inline octomap::Pointcloud cloud_of(const DepthImage& depth, const CameraIntrinsics& c,
                                    const Transform<Base, Depth>& base_T_depth) {
  octomap::Pointcloud cloud;
  cloud.reserve(depth.pixels.size());
  for (int v = 0; v < depth.pixels.height; ++v) {
    for (int u = 0; u < depth.pixels.width; ++u) {
      if (depth.pixels.at(u, v) == 0) continue;
      const double z_m = depth.pixels.at(u, v) / depth.units_per_m;
      cloud.push_back(
          to_octomap(base_T_depth * Eigen::Vector3d((u - c.cx) / c.fx * z_m, (v - c.cy) / c.fy * z_m, z_m)));
    }
  }
  return cloud;
}

/// Inserts the returns of an undistorted frame.
inline void insert_into(octomap::OcTree& tree, const DepthImage& depth, const CameraIntrinsics& c,
                        const Transform<Base, Depth>& base_T_depth, double range_max_m, bool discretize = false) {
  tree.insertPointCloud(cloud_of(depth, c, base_T_depth), to_octomap(base_T_depth.translation()), range_max_m, false,
                        discretize);
}

struct Agreement {
  std::size_t known_there = 0;    ///< voxels of the tree inside the grid
  std::size_t outside = 0;        ///< voxels of the tree outside the grid
  std::size_t class_differs = 0;  ///< near ties apart
  std::size_t near_ties = 0;      ///< class differs at |log-odds| < 0.2
  double log_odds_error_max = 0;
};

/// Compares every voxel that the tree knows with the map, pruned leaves opened up.
inline Agreement compare(const VoxelMap& map, const octomap::OcTree& tree) {
  const GridGeometry& g = map.geometry();
  Agreement agreement;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    const int edge = 1 << (16 - leaf.getDepth());
    const octomap::OcTreeKey key = leaf.getIndexKey();
    const Eigen::Vector3i low = Eigen::Vector3i(key[0], key[1], key[2]) - Eigen::Vector3i::Constant(32768) - g.first;
    const double value = static_cast<double>(leaf->getLogOdds());
    for (int z = 0; z < edge; ++z) {
      for (int y = 0; y < edge; ++y) {
        for (int x = 0; x < edge; ++x) {
          const Eigen::Vector3i voxel = low + Eigen::Vector3i(x, y, z);
          if (!g.contains(voxel)) {
            ++agreement.outside;
            continue;
          }
          ++agreement.known_there;
          const std::size_t index = g.index(voxel);
          const VoxelClass expected = value >= 0 ? VoxelClass::kOccupied : VoxelClass::kFree;
          if (map.voxel_class(index) != expected) {
            const bool tie = map.voxel_class(index) != VoxelClass::kUnknown && std::abs(value) < 0.2;
            ++(tie ? agreement.near_ties : agreement.class_differs);
          }
          const double error = std::abs(map.log_odds(index) * kLogOddsUnit - value);
          agreement.log_odds_error_max = std::max(agreement.log_odds_error_max, error);
        }
      }
    }
  }
  return agreement;
}

}  // namespace firstlook
