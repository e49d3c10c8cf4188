/// Maps with something to prune, and OctoMap's reading of trees that are in memory.
#pragma once

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>

#include "octomap_oracle.hpp"
#include "platform/core/random.hpp"
#include "tests/support/collect_bytes.hpp"

namespace firstlook {

/// Blocks of one value (so that pruning happens) and single voxels of others, across the origin of the keys.
inline VoxelMap blocky_map(Random& random) {
  VoxelMap map(GridGeometry{0.05, {-21, -9, -5}, {37, 26, 19}});
  std::vector<std::uint64_t> missed(VoxelMap::bit_words(map.geometry())), hit(missed.size());
  for (int frame = 0; frame < 6; ++frame) {
    std::fill(missed.begin(), missed.end(), 0);
    std::fill(hit.begin(), hit.end(), 0);
    for (int block = 0; block < 5; ++block) {
      const Eigen::Vector3i low(random.below(24), random.below(14), random.below(8));
      const int edge = 4 + random.below(9);
      std::vector<std::uint64_t>& plane = random.below(2) == 0 ? missed : hit;
      for (std::size_t i = 0; i < map.size(); ++i) {
        const Eigen::Vector3i v = map.geometry().voxel_at(i) - low;
        if (v.minCoeff() >= 0 && v.maxCoeff() < edge) plane[i / 64] |= 1ULL << (i % 64);
      }
    }
    for (int i = 0; i < 200; ++i) {
      const auto at = static_cast<std::size_t>(random.below(static_cast<int>(map.size())));
      hit[at / 64] |= 1ULL << (at % 64);
    }
    map.apply(missed, hit, {}, frame);
  }
  return map;
}

inline std::unique_ptr<octomap::OcTree> read_bt(const std::string& text) {
  auto tree = std::make_unique<octomap::OcTree>(0.05);
  std::istringstream stream(text);
  REQUIRE(tree->readBinary(stream));
  return tree;
}

inline std::unique_ptr<octomap::OcTree> read_ot(const std::string& text) {
  std::istringstream stream(text);
  std::unique_ptr<octomap::AbstractOcTree> any(octomap::AbstractOcTree::read(stream));
  auto* tree = dynamic_cast<octomap::OcTree*>(any.get());
  REQUIRE(tree != nullptr);
  (void)any.release();
  return std::unique_ptr<octomap::OcTree>(tree);
}

}  // namespace firstlook
