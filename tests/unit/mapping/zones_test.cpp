#include <catch2/catch.hpp>
#include <vector>

#include "algorithms/mapping/reach_zone.hpp"
#include "algorithms/mapping/remaining.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

// Free everywhere but for some unknown blocks.
struct Blocks {
  VoxelMap map{GridGeometry{0.1, {-5, -5, 0}, {10, 10, 10}}};
  Blocks() {
    for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
  }
  void fill(const Eigen::Vector3i& low, const Eigen::Vector3i& high, VoxelClass voxel_class) {
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Eigen::Vector3i v = map.geometry().voxel_at(i);
      if ((v.array() >= low.array()).all() && (v.array() < high.array()).all()) map.set(i, voxel_class, 0);
    }
  }
};

}  // namespace

TEST_CASE("unknown clusters are found with size, place and frontier", "[mapping][remaining]") {
  Blocks blocks;
  blocks.fill({1, 1, 1}, {3, 3, 3}, VoxelClass::kUnknown);  // 8 voxels
  blocks.fill({5, 5, 5}, {8, 8, 8}, VoxelClass::kUnknown);  // 27, its core does not touch free space
  blocks.fill({9, 0, 0}, {10, 1, 1}, VoxelClass::kUnknown);
  const std::vector<UnknownCluster> clusters = find_remaining(blocks.map, {}, 1);
  REQUIRE(clusters.size() == 3);
  CHECK(clusters[0].voxels == 27);
  CHECK(clusters[0].frontier.size() == 26);
  CHECK(clusters[0].center_m.isApprox(Eigen::Vector3d(0.15, 0.15, 0.65)));
  CHECK(clusters[0].box.low_m.isApprox(Eigen::Vector3d(0, 0, 0.5), 1e-9));
  CHECK(clusters[0].box.high_m.isApprox(Eigen::Vector3d(0.3, 0.3, 0.8)));
  CHECK(clusters[1].voxels == 8);
  CHECK(clusters[2].voxels == 1);
  CHECK(find_remaining(blocks.map, {}, 9).size() == 1);
}

TEST_CASE("unknown behind walls or outside the zone is left out", "[mapping][remaining]") {
  Blocks blocks;
  blocks.fill({0, 0, 0}, {6, 6, 6}, VoxelClass::kOccupied);
  blocks.fill({1, 1, 1}, {5, 5, 5}, VoxelClass::kUnknown);  // sealed in
  CHECK(find_remaining(blocks.map, {}, 1).empty());
  blocks.fill({1, 1, 5}, {2, 2, 6}, VoxelClass::kUnknown);  // a hole in the lid
  CHECK(find_remaining(blocks.map, {}, 1).size() == 1);
  std::vector<std::uint8_t> zone(blocks.map.size(), 1);
  zone[blocks.map.geometry().index({1, 1, 5})] = 0;
  CHECK(find_remaining(blocks.map, zone, 1).empty());
}

TEST_CASE("blocks that touch only by an edge are two clusters", "[mapping][remaining]") {
  Blocks blocks;
  blocks.fill({1, 1, 1}, {2, 2, 2}, VoxelClass::kUnknown);
  blocks.fill({2, 2, 1}, {3, 3, 2}, VoxelClass::kUnknown);
  CHECK(find_remaining(blocks.map, {}, 1).size() == 2);
}

TEST_CASE("no body point of a UR5 leaves the reach zone", "[mapping][reach]") {
  const ArmModel arm = find_arm_model("ur5").value();
  Capsules body = arm.body;
  Capsule camera;
  camera.link = arm.joints;
  camera.a = {0, 0.05, 0};
  camera.b = {0, 0.12, 0.08};
  camera.radius_m = 0.06;
  body.push_back(camera);
  const double reach = reach_m(arm, body);
  CHECK(reach > 1.0);
  CHECK(reach < 1.5);

  const GridGeometry geometry = GridGeometry::covering({-1.6, -1.6, -0.3}, {1.6, 1.6, 1.8}, 0.05);
  std::vector<std::uint8_t> zone(geometry.count(), 9);
  const std::size_t marked = mark_reach_zone(geometry, arm, body, 0.05, -0.02, zone);
  std::size_t ones = 0;
  for (const std::uint8_t z : zone) {
    REQUIRE(z <= 1);
    ones += z;
  }
  CHECK(ones == marked);
  Random random(12);
  for (int i = 0; i < 3000; ++i) {
    JointVector q = JointVector::zero(arm.joints);
    for (int j = 0; j < arm.joints; ++j) q[j] = random.uniform(-3.14, 3.14);
    if (i % 2 == 0)
      for (int j = 2; j < arm.joints; ++j) q[j] = 0;  // stretched out
    for (const Capsule& capsule : place(body, forward(arm, q))) {
      if (capsule.link == 0) continue;
      const Eigen::Vector3d p = capsule.a + capsule.radius_m * random.direction();
      if (p.z() <= 0.03 || !geometry.contains(geometry.voxel(p))) continue;
      REQUIRE(zone[geometry.index(geometry.voxel(p))] == 1);
    }
  }
}

}  // namespace firstlook
