/// All memory of the map is taken at construction: frames, views and fields allocate nothing.
#include <catch2/catch.hpp>
#include <vector>

#include "algorithms/mapping/color_registration.hpp"
#include "algorithms/mapping/distance_field.hpp"
#include "algorithms/mapping/insertion.hpp"
#include "algorithms/mapping/open_rays.hpp"
#include "algorithms/mapping/ray_cast.hpp"
#include "platform/core/random.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook {
namespace {

constexpr int kWidth = 61, kHeight = 45;  // no whole number of vectors

const GridGeometry kGrid =
    GridGeometry::covering(Eigen::Vector3d::Constant(-1.2), Eigen::Vector3d::Constant(1.2), 0.05);

DepthSensor sensor_with(double k1) {
  DepthSensor sensor;
  sensor.intrinsics = {kWidth, kHeight, 50, 50, 30.2, 22.1};
  sensor.intrinsics.k1 = k1;
  sensor.range_min_m = 0.1;
  sensor.range_max_m = sensor.range_trusted_m = 1.5;
  return sensor;
}

/// Walls, noise, holes, returns beyond the range and too near ones.
std::vector<std::uint16_t> random_depth(Random& random) {
  std::vector<std::uint16_t> values(static_cast<std::size_t>(kWidth) * kHeight);
  const double wall_m = random.uniform(0.3, 1.8);
  for (std::uint16_t& value : values)
    value = random.uniform() < 0.1 ? std::uint16_t{0}
                                   : static_cast<std::uint16_t>(1000 * wall_m * random.uniform(0.9, 1.1));
  return values;
}

Transform<Base, Depth> random_pose(Random& random) { return {random.rotation(), 0.4 * random.direction()}; }

template <typename Work>
std::uint64_t allocations_of(Work work) {
  memory::JobHeapScope heap(memory::kHeapUncapped);
  work();
  return heap.allocations();
}

}  // namespace

TEST_CASE("the count sees an allocation", "[mapping][memory]") {
  if (!memory::counts_malloc()) return;  // a sanitizer owns malloc
  CHECK(allocations_of([] { std::vector<int>(100).clear(); }) == 1);
}

TEST_CASE("frames are inserted without an allocation", "[mapping][memory]") {
  const RayEnds ends = GENERATE(RayEnds::kPixels, RayEnds::kVoxelCenters);
  const auto planes = GENERATE(VoxelMap::Planes::kAll, VoxelMap::Planes::kWithOpenRays, VoxelMap::Planes::kLogOddsOnly);
  const DepthSensor sensor = sensor_with(GENERATE(0.0, -0.1));  // by voxels, and by rays
  VoxelMap map(kGrid, planes);
  Inserter inserter(kGrid, sensor, ends);
  OpenRays open_rays(kGrid, sensor);
  const std::vector<float> self_m(static_cast<std::size_t>(kWidth) * kHeight, 1.2F);
  Random random(5);
  for (int frame = 0; frame < 4; ++frame) {
    const std::vector<std::uint16_t> values = random_depth(random);
    const Transform<Base, Depth> pose = random_pose(random);
    const DepthImage depth{{values.data(), kWidth, kHeight}, 1000};
    std::size_t missed = 0;
    const std::uint64_t allocations = allocations_of([&] {
      const auto result = inserter.insert(map, depth, pose, self_m, frame);
      missed = result ? result->change.voxels_missed : 0;
      if (planes != VoxelMap::Planes::kWithOpenRays) return;
      open_rays.look(depth, self_m);
      open_rays.clear(map, pose, {inserter.missed(), inserter.hit()}, frame, 600);
    });
    CHECK(missed > 0);
    CHECK(allocations == 0);
  }
}

TEST_CASE("views are counted and the distance field follows the map without an allocation", "[mapping][memory]") {
  VoxelMap map(kGrid);
  GainPlane plane(kGrid);
  GainScratch scratch(kGrid);
  DistanceField field(kGrid, 0.6);
  std::vector<std::uint8_t> free(map.size());
  const GainRays rays = GainRays::pinhole(sensor_with(0).intrinsics, 31, 23, 1.5);
  Random random(6);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (random.uniform() < 0.9) map.set(i, VoxelClass::kFree, 0);
  }
  for (int view = 0; view < 4; ++view) {
    const Transform<Base, Depth> pose = random_pose(random);
    for (int i = 0; i < 300; ++i)
      map.set(static_cast<std::size_t>(random.below(static_cast<int>(map.size()))), VoxelClass::kOccupied, 0);
    std::uint32_t seen = 0;
    const std::uint64_t allocations = allocations_of([&] {
      for (const UnknownReading reading : {UnknownReading::kStop, UnknownReading::kSeeThrough}) {
        build_gain_plane(map, {}, reading, plane);
        seen += count_unknown(plane, rays, pose, 0.1, scratch).voxels;
      }
      map.free_mask(0, 600, free);
      field.update(free);
    });
    CHECK(seen > 0);
    CHECK(allocations == 0);
  }
}

TEST_CASE("colours and sensors of a frame are noted without an allocation", "[mapping][memory]") {
  const DepthSensor sensor = sensor_with(GENERATE(0.0, -0.1));
  const CameraIntrinsics camera{80, 60, 66, 66, 39.5, 29.5, -0.1};
  VoxelMap map(kGrid);
  Inserter inserter(kGrid, sensor);
  ColorRegistration registration(kGrid, sensor, camera);
  MapPlanes planes(kGrid, {true, true, true});
  const std::vector<Rgb> colors(80 * 60, Rgb{1, 2, 3});
  const std::vector<float> self_m(static_cast<std::size_t>(kWidth) * kHeight, 1.2F);
  Random random(7);
  std::uint32_t colored = 0;
  for (int frame = 0; frame < 4; ++frame) {
    const std::vector<std::uint16_t> values = random_depth(random);
    const Transform<Base, Depth> pose = random_pose(random);
    const DepthImage depth{{values.data(), kWidth, kHeight}, 1000};
    REQUIRE(inserter.insert(map, depth, pose, self_m, frame));
    const std::uint64_t allocations = allocations_of([&] {
      colored +=
          registration.add(*planes.color, depth, pose, self_m, {camera, {}}, {colors.data(), 80, 60}, inserter.hit());
      planes.sensor->note(inserter.missed(), inserter.hit(), 1);
    });
    CHECK(allocations == 0);
  }
  CHECK(colored > 0);
}

}  // namespace firstlook
