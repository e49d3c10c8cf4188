#include "algorithms/mapping/ray_cast.hpp"

#include <octomap/octomap.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <vector>

#include "platform/core/processor.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

const GridGeometry kGrid = GridGeometry::covering({-1, -1, -1}, {1, 1, 1}, 0.05);

// Mostly free, with unknown and occupied lumps.
VoxelMap lumpy_map(Random& random) {
  VoxelMap map(kGrid);
  for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
  for (int lump = 0; lump < 60; ++lump) {
    const Eigen::Vector3d center(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    const double radius_m = random.uniform(0.05, 0.25);
    const VoxelClass voxel_class = lump % 3 == 0 ? VoxelClass::kOccupied : VoxelClass::kUnknown;
    for (std::size_t i = 0; i < map.size(); ++i)
      if ((kGrid.center_m(kGrid.voxel_at(i)) - center).norm() < radius_m) map.set(i, voxel_class, 0);
  }
  return map;
}

GainRays fan(int columns, int rows) { return GainRays::pinhole({64, 48, 50, 50, 31.5, 23.5}, columns, rows, 5); }

// Points every tenth of a millimetre along the ray: slow and plain.
GainCount count_by_sampling(const VoxelMap& map, const GainRays& rays, const Transform<Base, Depth>& pose,
                            UnknownReading reading) {
  std::set<std::size_t> seen;
  for (const Eigen::Vector3d& end : rays.ends_m) {
    const Eigen::Vector3d direction = pose.rotation() * end.normalized();
    for (double t = 0; t < end.norm(); t += 1e-4) {
      const Eigen::Vector3i v = kGrid.voxel(pose.translation() + t * direction);
      if (!kGrid.contains(v)) continue;
      const std::size_t index = kGrid.index(v);
      if (map.voxel_class(index) == VoxelClass::kOccupied) break;
      if (map.voxel_class(index) != VoxelClass::kUnknown) continue;
      seen.insert(index);
      if (reading == UnknownReading::kStop) break;
    }
  }
  return {static_cast<std::uint32_t>(seen.size()), seen.size()};
}

GainCount count(const VoxelMap& map, const GainRays& rays, const Transform<Base, Depth>& pose, UnknownReading reading,
                std::span<const std::uint8_t> weights = {}, double range_min_m = 0) {
  GainPlane plane(kGrid);
  build_gain_plane(map, weights, reading, plane);
  GainScratch scratch(kGrid);
  return count_unknown(plane, rays, pose, range_min_m, scratch);
}

}  // namespace

TEST_CASE("the thesis's rays end on its plane", "[mapping][gain]") {
  const GainRays rays = GainRays::thesis();
  REQUIRE(rays.ends_m.size() == 8424);
  for (const Eigen::Vector3d& end : rays.ends_m) {
    REQUIRE(end.z() == 5.0);
    REQUIRE(end.norm() >= 5.0);
    REQUIRE(end.norm() <= 6.01);
  }
}

TEST_CASE("gain counts each unknown voxel of the rays once", "[mapping][gain]") {
  Random random(2);
  const VoxelMap map = lumpy_map(random);
  const GainRays rays = fan(12, 9);
  for (int i = 0; i < 12; ++i) {
    // The last ones stand outside the grid and look in.
    const double reach_m = i < 9 ? 0.6 : 1.6;
    const Transform<Base, Depth> pose(random.rotation(), reach_m * random.direction());
    for (const UnknownReading reading : {UnknownReading::kSeeThrough, UnknownReading::kStop}) {
      const GainCount fast = count(map, rays, pose, reading), plain = count_by_sampling(map, rays, pose, reading);
      CHECK(fast.weight == fast.voxels);
      // Sampling may miss a corner that a ray cuts by less than its step.
      CHECK(std::abs(static_cast<int>(fast.voxels) - static_cast<int>(plain.voxels)) <=
            1 + static_cast<int>(plain.voxels) / 100);
    }
  }
}

TEST_CASE("stopping at unknown gives the voxels where OctoMap's castRay ends", "[mapping][gain][octomap]") {
  Random random(7);
  const VoxelMap map = lumpy_map(random);
  octomap::OcTree tree(0.05);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (map.voxel_class(i) == VoxelClass::kUnknown) continue;
    const Eigen::Vector3d c = kGrid.center_m(kGrid.voxel_at(i));
    tree.updateNode(c.x(), c.y(), c.z(), map.voxel_class(i) == VoxelClass::kOccupied);
  }
  const GainRays rays = fan(24, 18);
  for (int view = 0; view < 10; ++view) {
    const Transform<Base, Depth> pose(random.rotation(), 0.5 * random.direction());
    const Eigen::Vector3d o = pose.translation();
    std::set<std::size_t> ends;
    for (const Eigen::Vector3d& end_m : rays.ends_m) {
      const Eigen::Vector3d d = pose.rotation() * end_m;
      octomap::point3d end;
      const bool hit = tree.castRay({static_cast<float>(o.x()), static_cast<float>(o.y()), static_cast<float>(o.z())},
                                    {static_cast<float>(d.x()), static_cast<float>(d.y()), static_cast<float>(d.z())},
                                    end, false, 5.0);
      const Eigen::Vector3i v =
          kGrid.voxel({static_cast<double>(end.x()), static_cast<double>(end.y()), static_cast<double>(end.z())});
      if (!hit && kGrid.contains(v) && map.voxel_class(kGrid.index(v)) == VoxelClass::kUnknown)
        ends.insert(kGrid.index(v));
    }
    const GainCount ours = count(map, rays, pose, UnknownReading::kStop);
    CHECK(std::abs(static_cast<int>(ours.voxels) - static_cast<int>(ends.size())) <= 1);  // a ray through an edge
  }
}

TEST_CASE("packets of rays count what rays walked one by one count, with AVX2 and without", "[mapping][gain]") {
  std::uint64_t counted = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Random random(seed, 17);
    const double resolution_m = random.uniform(0.02, 0.08);
    const Eigen::Vector3d low_m(random.uniform(-1.5, -0.5), -1, random.uniform(-1.2, -0.6));
    VoxelMap map(GridGeometry::covering(low_m, {1, 1.1, 0.9}, resolution_m), VoxelMap::Planes::kLogOddsOnly);
    const int lumps = random.below(60);
    for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
    for (int lump = 0; lump < lumps; ++lump) {
      const Eigen::Vector3d center(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      const double radius_m = random.uniform(0.02, 0.3);
      for (std::size_t i = 0; i < map.size(); ++i) {
        if ((map.geometry().center_m(map.geometry().voxel_at(i)) - center).norm() < radius_m)
          map.set(i, lump % 3 == 0 ? VoxelClass::kOccupied : VoxelClass::kUnknown, 0);
      }
    }
    std::vector<std::uint8_t> weights(map.size());
    for (std::uint8_t& weight : weights) weight = static_cast<std::uint8_t>(random.below(3));
    GainPlane plane(map.geometry());
    GainScratch scratch(map.geometry());
    const GainRays rays = fan(30 + random.below(5), 21);
    for (const UnknownReading reading : {UnknownReading::kSeeThrough, UnknownReading::kStop}) {
      build_gain_plane(map, weights, reading, plane);
      for (int view = 0; view < 6; ++view) {
        // Two exactly along the grid's axes, from a voxel's face.
        const bool aligned = view < 2;
        const Eigen::Vector3d at_m =
            aligned ? Eigen::Vector3d(2 * resolution_m, 0, view * 0.013) : Eigen::Vector3d(0.7 * random.direction());
        const Transform<Base, Depth> pose(aligned ? Eigen::Quaterniond::Identity() : random.rotation(), at_m);
        const double range_min_m = random.uniform(0, 0.5);
        const GainCount walked = count_unknown_by_walking(plane, rays, pose, range_min_m, scratch);
        const GainCount packets = count_unknown(plane, rays, pose, range_min_m, scratch);
        const PortableOnly without_avx2;
        const GainCount portable = count_unknown(plane, rays, pose, range_min_m, scratch);
        INFO("seed " << seed << " view " << view);
        REQUIRE(packets.voxels == walked.voxels);
        REQUIRE(packets.weight == walked.weight);
        REQUIRE(portable.weight == walked.weight);
        counted += walked.voxels;
      }
    }
  }
  CHECK(counted > 50000);
}

TEST_CASE("weights count, zero weight is seen through, the near part counts nothing", "[mapping][gain]") {
  VoxelMap map(kGrid);  // all unknown
  GainRays one;
  one.ends_m = {{0, 0, 0.9}};
  const Transform<Base, Depth> pose(Eigen::Quaterniond::Identity(), {0.025, 0.025, 0.025});
  CHECK(count(map, one, pose, UnknownReading::kSeeThrough).voxels == 19);
  CHECK(count(map, one, pose, UnknownReading::kStop).voxels == 1);
  std::vector<std::uint8_t> weights(map.size(), 7);
  const auto at = [](double z_m) { return kGrid.index(kGrid.voxel({0.025, 0.025, z_m})); };
  weights[at(0.125)] = 0;
  weights[at(0.225)] = 255;
  const GainCount weighted = count(map, one, pose, UnknownReading::kSeeThrough, weights);
  CHECK(weighted.voxels == 18);
  CHECK(weighted.weight == 17 * 7 + 253);
  CHECK(count(map, one, pose, UnknownReading::kSeeThrough, {}, 0.4751).voxels == 9);
  map.set(at(0.525), VoxelClass::kOccupied, 0);
  CHECK(count(map, one, pose, UnknownReading::kSeeThrough).voxels == 10);
  map.set(at(0.025), VoxelClass::kOccupied, 0);
  CHECK(count(map, one, pose, UnknownReading::kSeeThrough).voxels == 0);
}

TEST_CASE("the counter of views wraps without losing voxels", "[mapping][gain]") {
  VoxelMap map(kGrid);
  GainPlane plane(kGrid);
  build_gain_plane(map, {}, UnknownReading::kSeeThrough, plane);
  GainScratch scratch(kGrid);
  const GainRays rays = fan(6, 4);
  const Transform<Base, Depth> here(Eigen::Quaterniond::Identity(), {0, 0, 0}),
      there(Eigen::Quaterniond::Identity(), {9, 9, 9});
  const auto look = [&](const Transform<Base, Depth>& pose) {
    return count_unknown(plane, rays, pose, 0, scratch).voxels;
  };
  const std::uint32_t first = look(here);
  REQUIRE(first > 0);
  for (int i = 0; i < 255; ++i) REQUIRE(look(there) == 0);  // marks of `here` stay as they were
  for (int i = 0; i < 600; ++i) REQUIRE(look(here) == first);
}

}  // namespace firstlook
