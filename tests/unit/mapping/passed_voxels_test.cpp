#include "algorithms/mapping/passed_voxels.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <vector>

#include "algorithms/mapping/ray_marker.hpp"
#include "platform/core/processor.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

constexpr int kWidth = 200, kHeight = 150;

/// Boxes before a slanted wall, noise, speckle, holes and blind stripes: what makes voxels hard to decide.
std::vector<std::uint16_t> random_depth(Random& random) {
  std::vector<std::uint16_t> values;
  const double wall_m = random.uniform(0.3, 3.0), slant = random.uniform(-1, 1), tilt = random.uniform(-0.5, 0.5);
  const double holes = random.uniform(0, 0.3), speckle = random.uniform(0, 0.1);
  const int stripe = random.below(60) + 5, box_u = random.below(kWidth), box_v = random.below(kHeight);
  const double box_m = random.uniform(0.05, wall_m);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      double z_m = wall_m * (1 + 0.5 * slant * (u - 100) / 100.0 + tilt * (v - 75) / 75.0);
      if (u > box_u && v > box_v && u < box_u + 50 && v < box_v + 30) z_m = box_m;
      if (random.uniform() < speckle) z_m = random.uniform(0.02, 6.0);
      z_m += 0.003 * z_m * z_m * random.normal();
      const bool hole = random.uniform() < holes || u % stripe < 2 || z_m <= 0;
      values.push_back(hole ? std::uint16_t{0} : static_cast<std::uint16_t>(std::min(65.0, z_m) * 1000));
    }
  }
  return values;
}

struct Planes {
  std::vector<std::uint64_t> hits, by_rays, by_four_rays, by_voxels, portable;
};

Planes both_ways(const GridGeometry& geometry, const DepthSensor& sensor, const std::vector<std::uint16_t>& values,
                 const Transform<Base, Depth>& pose) {
  const DepthImage depth{{values.data(), kWidth, kHeight}, 1000};
  DepthRays rays(sensor);
  RangeImage image(kWidth, kHeight);
  Planes planes;
  for (auto* plane : {&planes.hits, &planes.by_rays, &planes.by_four_rays, &planes.by_voxels, &planes.portable}) {
    plane->assign(VoxelMap::bit_words(geometry), 0);
  }
  RayMarker marker(geometry, pose.translation().cast<float>(), planes.by_rays);
  std::vector<Eigen::Vector3f> ends_m;
  rays.for_each(depth, pose, {}, [&](const RayEnd& ray) {
    marker.mark_passed(ray.end_m);
    ends_m.push_back(ray.end_m);
    const Eigen::Vector3i voxel = octomap_voxel(geometry, ray.end_m);
    if (!ray.is_hit || !geometry.contains(voxel)) return;
    planes.hits[geometry.index(voxel) >> 6] |= 1ULL << (geometry.index(voxel) & 63);
  });
  rays.for_each_row(depth, pose, {}, [&](int v, const RayRow& row) {
    std::vector<float> reach_m = row.reach_m;
    for (std::size_t u = 0; u < reach_m.size(); ++u) {
      if (row.kind[u] > PixelKind::kBeyond) reach_m[u] = RangeImage::kNoRay;
    }
    image.set_row(v, reach_m);
  });
  image.build_levels();
  RayMarker(geometry, pose.translation().cast<float>(), planes.by_four_rays).mark_all_passed(ends_m);
  mark_passed_voxels(geometry, rays, image, depth, pose, planes.hits, planes.by_voxels);
  const PortableOnly without_avx2;
  mark_passed_voxels(geometry, rays, image, depth, pose, planes.hits, planes.portable);
  return planes;
}

int differences(const Planes& planes) {
  int count = 0;
  for (std::size_t i = 0; i < planes.hits.size(); ++i) {
    count += std::popcount((planes.by_rays[i] ^ planes.by_voxels[i]) & ~planes.hits[i]);
    count += std::popcount((planes.by_rays[i] ^ planes.portable[i]) & ~planes.hits[i]);
    count += std::popcount(planes.by_rays[i] ^ planes.by_four_rays[i]);
  }
  return count;
}

int marked(const std::vector<std::uint64_t>& plane) {
  int count = 0;
  for (const std::uint64_t word : plane) count += std::popcount(word);
  return count;
}

DepthSensor random_sensor(Random& random) {
  const double focal_px = random.uniform(60, 500);
  DepthSensor sensor;
  sensor.intrinsics = {
      kWidth, kHeight, focal_px, focal_px * random.uniform(0.9, 1.1), random.uniform(60, 140), random.uniform(40, 110)};
  sensor.range_min_m = random.uniform(0, 0.5);
  sensor.range_max_m = random.uniform(0.8, 5);
  sensor.range_trusted_m = sensor.range_max_m;
  return sensor;
}

}  // namespace

TEST_CASE("asking voxel by voxel marks what walking along every ray marks", "[mapping]") {
  int marks = 0;
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    Random random(seed, 31);
    const DepthSensor sensor = random_sensor(random);
    const double resolution_m = seed % 5 == 0 ? 0.02 : random.uniform(0.03, 0.15);
    const Eigen::Vector3d low_m(random.uniform(-2, 0), random.uniform(-2, 0), random.uniform(-2, 0));
    const Eigen::Vector3d high_m = low_m + Eigen::Vector3d(random.uniform(0.5, 4), random.uniform(0.5, 4), 2);
    const GridGeometry geometry = GridGeometry::covering(low_m, high_m, resolution_m);
    const Eigen::Vector3d position_m(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2));
    const Transform<Base, Depth> pose(random.rotation(), position_m);  // inside the grid and outside
    const Planes planes = both_ways(geometry, sensor, random_depth(random), pose);
    INFO("seed " << seed);
    REQUIRE(differences(planes) == 0);
    marks += marked(planes.by_voxels);
  }
  CHECK(marks > 100000);
}

TEST_CASE("rays along axes and sensors on voxel faces leave no difference either", "[mapping]") {
  DepthSensor sensor;
  sensor.intrinsics = {kWidth, kHeight, 100, 100, 100, 75};  // a pixel looks exactly along the axis
  sensor.range_min_m = 0;
  sensor.range_max_m = sensor.range_trusted_m = 2;
  const GridGeometry geometry =
      GridGeometry::covering(Eigen::Vector3d::Constant(-1.5), Eigen::Vector3d::Constant(1.5), 0.05);
  Random random(7);
  const std::vector<std::uint16_t> flat(kWidth * kHeight, 1000);
  Eigen::Matrix3d along_x;
  along_x << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (const Eigen::Quaterniond& rotation : {Eigen::Quaterniond::Identity(), Eigen::Quaterniond(along_x)}) {
    for (const double offset_m : {0.0, 0.05, 0.025, 1e-7, -1e-7, 4e-6}) {
      const Transform<Base, Depth> pose(rotation, Eigen::Vector3d::Constant(offset_m));
      CHECK(differences(both_ways(geometry, sensor, flat, pose)) == 0);
      CHECK(differences(both_ways(geometry, sensor, random_depth(random), pose)) == 0);
    }
  }
}

TEST_CASE("a frame without any ray marks nothing", "[mapping]") {
  Random random(3);
  DepthSensor sensor = random_sensor(random);
  const GridGeometry geometry =
      GridGeometry::covering(Eigen::Vector3d::Constant(-1), Eigen::Vector3d::Constant(1), 0.05);
  const std::vector<std::uint16_t> empty(kWidth * kHeight, 0);
  CHECK(marked(both_ways(geometry, sensor, empty, Transform<Base, Depth>()).by_voxels) == 0);
}

}  // namespace firstlook
