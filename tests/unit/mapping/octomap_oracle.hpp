/// OctoMap as the oracle of the tests.
#pragma once

#include <catch2/catch.hpp>

#include "tests/support/octomap_peer.hpp"

namespace firstlook {

/// The map knows exactly the voxels that the tree knows, with the same classes.
inline void require_equal(const VoxelMap& map, const octomap::OcTree& tree) {
  const Agreement agreement = compare(map, tree);
  const VoxelCounts counts = map.counts();
  INFO(agreement.known_there << " voxels, " << agreement.near_ties << " near ties");
  REQUIRE(agreement.known_there > 0);
  CHECK(agreement.class_differs == 0);
  CHECK(agreement.near_ties * 100000 <= agreement.known_there);
  CHECK(counts.free + counts.occupied == agreement.known_there);
}

}  // namespace firstlook
