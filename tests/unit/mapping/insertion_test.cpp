#include "algorithms/mapping/insertion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "octomap_oracle.hpp"
#include "platform/core/processor.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

constexpr int kWidth = 96, kHeight = 72;

DepthSensor small_sensor(double range_max_m) {
  DepthSensor sensor;
  sensor.intrinsics = {kWidth, kHeight, 80, 81, 47.3, 35.8};
  sensor.range_min_m = 0;
  sensor.range_max_m = sensor.range_trusted_m = range_max_m;
  return sensor;
}

struct Frame {
  std::vector<std::uint16_t> values;
  Transform<Base, Depth> base_T_depth;
  [[nodiscard]] DepthImage image() const { return {{values.data(), kWidth, kHeight}, 1000}; }
};

// A slanted wall with bumps, speckle and holes, seen from a random pose near the middle.
Frame random_frame(Random& random) {
  Frame frame;
  const double wall_m = random.uniform(0.6, 3.0), slant = random.uniform(-1, 1), holes = random.uniform(0, 0.4);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      double z_m = wall_m * (1 + 0.3 * slant * (u - 48) / 48.0 + 0.1 * std::sin(0.3 * v));
      if (random.uniform() < 0.05) z_m = random.uniform(0.05, 6.0);
      const bool hole = random.uniform() < holes;
      frame.values.push_back(hole ? std::uint16_t{0} : static_cast<std::uint16_t>(z_m * 1000));
    }
  }
  const Eigen::Vector3d position_m(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4));
  frame.base_T_depth = Transform<Base, Depth>(random.rotation(), position_m);
  return frame;
}

GridGeometry cube(double half_m, double resolution_m) {
  return GridGeometry::covering(Eigen::Vector3d::Constant(-half_m), Eigen::Vector3d::Constant(half_m), resolution_m);
}

// One pixel straight ahead of a camera at the origin of voxel (0.5, 0.5, 0.5), looking along z.
struct OneRay {
  GridGeometry geometry = cube(2, 0.1);
  DepthSensor sensor;
  VoxelMap map{geometry};
  std::uint16_t value = 0;
  Transform<Base, Depth> pose{Eigen::Quaterniond::Identity(), {0.05, 0.05, 0.05}};

  OneRay() {
    sensor.intrinsics = {1, 1, 100, 100, 0, 0};
    sensor.range_min_m = 0.3;
    sensor.range_max_m = 1.6;
    sensor.range_trusted_m = 1.2;
  }
  Result<InsertionResult> insert(std::uint16_t depth_mm, std::span<const float> self_depth_m = {}) {
    value = depth_mm;
    Inserter inserter(geometry, sensor);
    return inserter.insert(map, {{&value, 1, 1}, 1000}, pose, self_depth_m, 1.0);
  }
  [[nodiscard]] VoxelClass at(double z_m) const { return map.class_at({0.05, 0.05, z_m}); }
};

}  // namespace

TEST_CASE("random scans give OctoMap's classes voxel for voxel", "[mapping][octomap]") {
  const double resolution_m = GENERATE(0.05, 0.02);
  const double range_max_m = GENERATE(1.3, 2.5);
  const DepthSensor sensor = small_sensor(range_max_m);
  VoxelMap map(cube(3.0, resolution_m), VoxelMap::Planes::kLogOddsOnly);
  Inserter inserter(map.geometry(), sensor);
  octomap::OcTree tree(resolution_m);
  Random random(11, static_cast<std::uint64_t>(resolution_m * 1000));
  for (int i = 0; i < 8; ++i) {
    const Frame frame = random_frame(random);
    REQUIRE(inserter.insert(map, frame.image(), frame.base_T_depth, {}, i));
    insert_into(tree, frame.image(), sensor.intrinsics, frame.base_T_depth, range_max_m);
  }
  require_equal(map, tree);
  CHECK(compare(map, tree).outside == 0);
}

TEST_CASE("discretized scans give OctoMap's discretized classes voxel for voxel", "[mapping][octomap]") {
  const double resolution_m = GENERATE(0.05, 0.02);
  const double range_max_m = GENERATE(1.3, 2.5);  // voxels lie across the shorter one
  const bool small_grid = GENERATE(false, true);
  const DepthSensor sensor = small_sensor(range_max_m);
  const GridGeometry geometry =
      small_grid ? GridGeometry::covering({-0.3, 0.25, -0.6}, {0.9, 1.1, 0.2}, resolution_m) : cube(3.0, resolution_m);
  VoxelMap map(geometry, VoxelMap::Planes::kLogOddsOnly);
  Inserter inserter(geometry, sensor, RayEnds::kVoxelCenters);
  octomap::OcTree tree(resolution_m);
  Random random(12, static_cast<std::uint64_t>(resolution_m * 1000));
  for (int i = 0; i < 12; ++i) {
    const Frame frame = random_frame(random);
    REQUIRE(inserter.insert(map, frame.image(), frame.base_T_depth, {}, i));
    insert_into(tree, frame.image(), sensor.intrinsics, frame.base_T_depth, range_max_m, true);
  }
  require_equal(map, tree);
  CHECK((compare(map, tree).outside > 0) == small_grid);
}

TEST_CASE("a frame gives the same map with AVX2 and without", "[mapping]") {
  for (const RayEnds ends : {RayEnds::kPixels, RayEnds::kVoxelCenters}) {
    for (const double resolution_m : {0.05, 0.02}) {
      const DepthSensor sensor = small_sensor(2.5);
      const GridGeometry geometry = cube(1.5, resolution_m);
      VoxelMap fast(geometry), portable(geometry), coarse(geometry, VoxelMap::Planes::kLogOddsOnly);
      Inserter inserter(geometry, sensor, ends);
      Random random(13);
      for (int i = 0; i < 12; ++i) {
        const Frame frame = random_frame(random);
        const auto a = inserter.insert(fast, frame.image(), frame.base_T_depth, {}, i);
        const auto c = inserter.insert(coarse, frame.image(), frame.base_T_depth, {}, i);
        const PortableOnly without_avx2;
        const auto b = inserter.insert(portable, frame.image(), frame.base_T_depth, {}, i);
        REQUIRE((a && b && c));
        CHECK(a->pixels_used == b->pixels_used);
        CHECK(a->change.voxels_missed == b->change.voxels_missed);
        // The map that keeps log-odds only counts the same 64 voxels at a time.
        CHECK(a->change.voxels_missed == c->change.voxels_missed);
        CHECK(a->change.voxels_hit == c->change.voxels_hit);
        CHECK(a->change.voxels_discovered == c->change.voxels_discovered);
      }
      CHECK(std::equal(fast.log_odds().begin(), fast.log_odds().end(), portable.log_odds().begin()));
      CHECK(std::equal(fast.log_odds().begin(), fast.log_odds().end(), coarse.log_odds().begin()));
      int octants_differ = 0;
      for (std::size_t i = 0; i < fast.size(); ++i) {
        octants_differ += fast.octants(i).crossed != portable.octants(i).crossed ||
                          fast.octants(i).surface != portable.octants(i).surface;
      }
      CHECK(octants_differ == 0);
    }
  }
}

TEST_CASE("repeated scans run into OctoMap's clamps and out of them", "[mapping][octomap]") {
  const DepthSensor sensor = small_sensor(2.5);
  VoxelMap map(cube(3.0, 0.05));
  Inserter inserter(map.geometry(), sensor);
  octomap::OcTree tree(0.05);
  Random random(5);
  const Frame near_wall = random_frame(random), far_wall = random_frame(random);
  for (const int repeats : {9, 12, 3}) {
    for (const Frame& scene : {near_wall, far_wall}) {
      for (int i = 0; i < repeats; ++i) {
        Frame frame = scene;
        frame.base_T_depth = near_wall.base_T_depth;  // the same rays see wall, then what was behind it
        REQUIRE(inserter.insert(map, frame.image(), frame.base_T_depth, {}, i));
        insert_into(tree, frame.image(), sensor.intrinsics, frame.base_T_depth, 2.5);
      }
    }
  }
  require_equal(map, tree);
  CHECK(compare(map, tree).log_odds_error_max < 0.05);  // rounding of 24 updates
}

TEST_CASE("a grid smaller than the scan holds what OctoMap has there", "[mapping][octomap]") {
  const DepthSensor sensor = small_sensor(2.5);
  const GridGeometry geometry = GridGeometry::covering({-0.3, 0.25, -0.6}, {0.9, 1.1, 0.2}, 0.05);
  VoxelMap map(geometry);
  Inserter inserter(geometry, sensor);
  octomap::OcTree tree(0.05);
  Random random(21);
  for (int i = 0; i < 12; ++i) {  // the sensor stands inside and outside
    const Frame frame = random_frame(random);
    REQUIRE(inserter.insert(map, frame.image(), frame.base_T_depth, {}, i));
    insert_into(tree, frame.image(), sensor.intrinsics, frame.base_T_depth, 2.5);
  }
  require_equal(map, tree);
  CHECK(compare(map, tree).outside > 0);
}

TEST_CASE("rays along axes and on voxel boundaries are OctoMap's too", "[mapping][octomap]") {
  const DepthSensor sensor = small_sensor(2.0);
  VoxelMap map(cube(3.0, 0.05));
  Inserter inserter(map.geometry(), sensor);
  octomap::OcTree tree(0.05);
  Frame frame;
  frame.values.assign(kWidth * kHeight, 1000);
  for (const double offset_m : {0.0, 0.05, 0.025, 1e-9}) {
    frame.base_T_depth = Transform<Base, Depth>(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Constant(offset_m));
    REQUIRE(inserter.insert(map, frame.image(), frame.base_T_depth, {}, 0));
    insert_into(tree, frame.image(), sensor.intrinsics, frame.base_T_depth, 2.0);
  }
  require_equal(map, tree);
}

TEST_CASE("a return clears up to its voxel and marks it", "[mapping]") {
  OneRay ray;
  const Result<InsertionResult> result = ray.insert(800);
  REQUIRE(result);
  CHECK(result->pixels_used == 1);
  CHECK(result->change.voxels_hit == 1);
  CHECK(result->change.voxels_missed == 8);
  CHECK(ray.at(0.05) == VoxelClass::kFree);
  CHECK(ray.at(0.75) == VoxelClass::kFree);
  CHECK(ray.at(0.85) == VoxelClass::kOccupied);
  CHECK(ray.at(0.95) == VoxelClass::kUnknown);
}

TEST_CASE("beyond the trusted range a return clears and marks nothing", "[mapping]") {
  OneRay ray;
  const Result<InsertionResult> result = ray.insert(1500);
  REQUIRE(result);
  CHECK(result->pixels_beyond == 1);
  CHECK(result->change.voxels_hit == 0);
  CHECK(ray.at(1.15) == VoxelClass::kFree);
  CHECK(ray.at(1.25) == VoxelClass::kUnknown);
  CHECK(ray.at(1.55) == VoxelClass::kUnknown);
}

TEST_CASE("holes and returns below the minimum range tell nothing", "[mapping]") {
  OneRay ray;
  Result<InsertionResult> result = ray.insert(0);
  REQUIRE(result);
  CHECK(result->pixels_empty == 1);
  result = ray.insert(299);
  REQUIRE(result);
  CHECK(result->pixels_too_near == 1);
  CHECK(ray.map.counts().unknown == ray.map.size());
}

TEST_CASE("the arm's own body is dropped, what stands before it is kept", "[mapping]") {
  OneRay ray;
  const std::vector<float> body_m = {0.5999f};
  const Result<InsertionResult> own = ray.insert(600, body_m);
  REQUIRE(own);
  CHECK(own->pixels_self == 1);
  CHECK(ray.map.counts().unknown == ray.map.size());
  REQUIRE(ray.insert(900, body_m)->pixels_self == 1);
  CHECK(ray.insert(500, body_m)->pixels_used == 1);
  CHECK(ray.at(0.55) == VoxelClass::kOccupied);
}

TEST_CASE("a voxel both hit and passed in one frame is hit once", "[mapping]") {
  // Two pixels in one direction, one ends where the other passes.
  OneRay ray;
  ray.sensor.intrinsics = {2, 1, 1e9, 1e9, 0.5, 0};
  const std::vector<std::uint16_t> values = {500, 1000};
  Inserter inserter(ray.geometry, ray.sensor);
  REQUIRE(inserter.insert(ray.map, {{values.data(), 2, 1}, 1000}, ray.pose, {}, 1.0));
  CHECK(ray.map.log_odds(ray.geometry.index(ray.geometry.voxel({0.05, 0.05, 0.55}))) == kHitLogOdds);
  CHECK(ray.map.log_odds(ray.geometry.index(ray.geometry.voxel({0.05, 0.05, 0.75}))) == kMissLogOdds);
  CHECK(ray.map.log_odds(ray.geometry.index(ray.geometry.voxel({0.05, 0.05, 0.35}))) == kMissLogOdds);
}

TEST_CASE("lens distortion bends the rays", "[mapping]") {
  OneRay straight, bent;
  straight.sensor.intrinsics = bent.sensor.intrinsics = {1, 1, 100, 100, -60, 0};
  bent.sensor.intrinsics.k1 = -0.3;  // barrel: the pixel's true ray is farther out
  REQUIRE(straight.insert(800));
  REQUIRE(bent.insert(800));
  CHECK(straight.map.class_at({0.05 + 0.48, 0.05, 0.85}) == VoxelClass::kOccupied);
  CHECK(bent.map.class_at({0.05 + 0.48, 0.05, 0.85}) != VoxelClass::kOccupied);
  CHECK(bent.map.class_at({0.05 + 0.8 * 0.70, 0.05, 0.85}) == VoxelClass::kOccupied);
}

TEST_CASE("a frame that cannot be right is refused and changes nothing", "[mapping][hostile]") {
  OneRay ray;
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  Inserter inserter(ray.geometry, ray.sensor);
  const std::vector<std::uint16_t> values(4, 800);
  const DepthImage good = {{values.data(), 1, 1}, 1000};
  const std::vector<float> wrong_mask(3, 1.0f);
  Pose scaled = Pose::Identity(), mirrored = Pose::Identity(), no_number = Pose::Identity(), far = Pose::Identity();
  scaled.linear() *= 1.01;
  mirrored.linear()(0, 0) = -1;
  no_number.linear()(1, 2) = nan;
  far.translation().x() = 1e7;
  const auto refused = [&](const DepthImage& image, const Pose& pose, std::span<const float> mask, double stamp_s) {
    const Result<InsertionResult> result = inserter.insert(ray.map, image, Transform<Base, Depth>(pose), mask, stamp_s);
    return !result && result.error().fault == Fault::kFrameRefused;
  };
  const Pose pose = ray.pose.pose();
  CHECK(refused({{values.data(), 2, 1}, 1000}, pose, {}, 1));
  CHECK(refused({{nullptr, 1, 1}, 1000}, pose, {}, 1));
  for (const double scale : {0.0, -1.0, nan, infinite}) CHECK(refused({{values.data(), 1, 1}, scale}, pose, {}, 1));
  CHECK(refused(good, pose, wrong_mask, 1));
  for (const double stamp_s : {-1.0, nan, infinite}) CHECK(refused(good, pose, {}, stamp_s));
  for (const Pose& bad : {scaled, mirrored, no_number, far}) CHECK(refused(good, bad, {}, 1));
  for (const double bad : {nan, infinite}) {
    Pose shifted = pose;
    shifted.translation().y() = bad;
    CHECK(refused(good, shifted, {}, 1));
  }
  CHECK(ray.map.counts().unknown == ray.map.size());
  CHECK_FALSE(refused(good, pose, {}, 1));
}

TEST_CASE("the ground clears the way to it and marks nothing", "[mapping]") {
  Random random(21);
  const GroundPlane ground{-0.62, 0.04};
  const GridGeometry geometry = cube(2.5, 0.05);
  const DepthSensor sensor = small_sensor(2.2);
  Inserter plain(geometry, sensor), clearing(geometry, sensor);
  clearing.set_ground(ground);
  std::size_t dropped = 0, kept = 0;
  for (int trial = 0; trial < 20; ++trial) {
    // A floor with boxes on it, seen from above at a slant.
    Frame frame = random_frame(random);
    const double tilt_rad = random.uniform(2.2, 3.1);
    frame.base_T_depth =
        Transform<Base, Depth>(Eigen::Quaterniond(Eigen::AngleAxisd(random.uniform(0, 6.28), Eigen::Vector3d::UnitZ()) *
                                                  Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitX())),
                               {0, 0, random.uniform(0, 0.4)});
    DepthRays rays(sensor);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const Eigen::Vector3d way = frame.base_T_depth.rotation() * rays.direction(u, v);
        const double box_m = u > 30 && u < 50 && v > 20 && v < 40 ? 0.15 : 0.0;
        const double z_m = (ground.height_m + box_m - frame.base_T_depth.translation().z()) / way.z();
        frame.values[static_cast<std::size_t>(v * kWidth + u)] =
            static_cast<std::uint16_t>(way.z() < 0 && z_m < 6 ? std::lround(1000 * z_m) : 0);
      }
    }
    VoxelMap plain_map(geometry), clearing_map(geometry);
    REQUIRE(plain.insert(plain_map, frame.image(), frame.base_T_depth, {}, 1));
    REQUIRE(clearing.insert(clearing_map, frame.image(), frame.base_T_depth, {}, 1));
    // From the ends themselves: what a return that is not on the floor hits.
    std::vector<bool> expected(geometry.count(), false);
    rays.for_each(frame.image(), frame.base_T_depth, {}, [&](const RayEnd& ray) {
      const Eigen::Vector3i voxel = geometry.voxel(ray.end_m.cast<double>());
      const bool floor = std::abs(static_cast<double>(ray.end_m.z()) - ground.height_m) <= ground.tolerance_m;
      if (ray.is_hit && !floor && geometry.contains(voxel)) expected[geometry.index(voxel)] = true;
    });
    for (std::size_t i = 0; i < geometry.count(); ++i) {
      REQUIRE((clearing_map.voxel_class(i) == VoxelClass::kOccupied) == expected[i]);
      if (plain_map.voxel_class(i) == VoxelClass::kFree) REQUIRE(clearing_map.voxel_class(i) == VoxelClass::kFree);
      dropped += plain_map.voxel_class(i) == VoxelClass::kOccupied && !expected[i] ? 1 : 0;
      kept += expected[i] ? 1 : 0;
    }
  }
  CHECK(dropped > 1000);
  CHECK(kept > 100);
}

TEST_CASE("an absurd depth scale makes no absurd rays", "[mapping][hostile]") {
  OneRay ray;
  Inserter inserter(ray.geometry, ray.sensor);
  const std::uint16_t value = 65535;
  for (const double units_per_m : {1e-300, 1e-30, 1e-10, 1e300}) {
    REQUIRE(inserter.insert(ray.map, {{&value, 1, 1}, units_per_m}, ray.pose, {}, 1));
    CHECK(ray.map.counts().occupied == 0);
  }
}

TEST_CASE("a far sensor outside the grid is no trouble", "[mapping][hostile]") {
  OneRay ray;
  ray.pose = Transform<Base, Depth>(Eigen::Quaterniond::Identity(), {0.05, 0.05, -2.9});
  ray.sensor.range_max_m = ray.sensor.range_trusted_m = 5;
  REQUIRE(ray.insert(3050));
  CHECK(ray.at(0.05) == VoxelClass::kFree);
  CHECK(ray.at(-1.95) == VoxelClass::kFree);
  CHECK(ray.at(0.15) == VoxelClass::kOccupied);
  ray.pose = Transform<Base, Depth>(Eigen::Quaterniond::Identity(), {500, 500, 500});
  REQUIRE(ray.insert(3000));
}

TEST_CASE("the declared memory is what the planes take", "[mapping]") {
  const GridGeometry geometry = cube(1, 0.05);
  CHECK(VoxelMap::required_bytes(geometry) >= 8 * geometry.count());
  CHECK(VoxelMap::required_bytes(geometry) < 8 * geometry.count() + 1024 * 1024);
  const std::size_t planes = 2 * ((geometry.count() + 63) / 64) * 8;
  const std::size_t pixels = kWidth * kHeight * sizeof(float);
  CHECK(Inserter::required_bytes(geometry, small_sensor(2)) >= planes + pixels + (kWidth + kHeight) * 8);
  CHECK(Inserter::required_bytes(geometry, small_sensor(2)) < planes + 16 * pixels);
  CHECK(Inserter::required_bytes(geometry, small_sensor(2), RayEnds::kVoxelCenters) ==
        Inserter::required_bytes(geometry, small_sensor(2)) + planes / 2);
}

}  // namespace firstlook
