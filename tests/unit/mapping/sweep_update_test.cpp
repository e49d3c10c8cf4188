#include "algorithms/mapping/sweep_update.hpp"

#include <limits>
#include <numbers>

#include "algorithms/mapping/insertion.hpp"
#include "octomap_oracle.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

constexpr double kStep_rad = 0.01;
const ScannerLimits kLimits{0.1, 2.5};

/// A scanner in a round room of radius 1.5 m that tilts about its x axis while it moves.
struct Sweep {
  std::vector<std::vector<float>> ranges;
  std::vector<Transform<Base, Depth>> poses;
  [[nodiscard]] ScanLine line(std::size_t i) const { return {poses[i], ranges[i], -1.0, kStep_rad}; }
};

Sweep random_sweep(Random& random, int lines) {
  Sweep sweep;
  const Eigen::Vector3d from_m(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2));
  const Eigen::Vector3d step_m(random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), 0);
  const Eigen::Quaterniond start = random.rotation();
  for (int i = 0; i < lines; ++i) {
    sweep.poses.emplace_back(start * Eigen::AngleAxisd(0.02 * i, Eigen::Vector3d::UnitX()), from_m + i * step_m);
    std::vector<float>& ranges = sweep.ranges.emplace_back();
    for (int k = 0; k < 200; ++k) {
      const double range_m = 1.2 + 0.4 * std::sin(0.05 * k) + 0.01 * random.normal();
      const double fate = random.uniform();
      ranges.push_back(fate < 0.05   ? std::numeric_limits<float>::infinity()
                       : fate < 0.08 ? std::numeric_limits<float>::quiet_NaN()
                       : fate < 0.10 ? 0.0F
                       : fate < 0.13 ? 0.05F
                       : fate < 0.20 ? 9.0F
                                     : static_cast<float>(range_m));
    }
  }
  return sweep;
}

GridGeometry cube(double resolution_m) {
  return GridGeometry::covering(Eigen::Vector3d::Constant(-2.8), Eigen::Vector3d::Constant(2.8), resolution_m);
}

/// OctoMap's update of one scan, but from a place for each line.
void insert_sweep(octomap::OcTree& tree, const Sweep& sweep) {
  octomap::KeySet free, occupied;
  octomap::KeyRay passed;
  for (std::size_t i = 0; i < sweep.poses.size(); ++i) {
    for (std::size_t k = 0; k < sweep.ranges[i].size(); ++k) {
      const auto range_m = static_cast<double>(sweep.ranges[i][k]);
      if (!std::isfinite(range_m) || range_m < kLimits.range_min_m) continue;
      const double angle_rad = -1.0 + kStep_rad * static_cast<double>(k);
      const double reach_m = std::min(range_m, kLimits.range_trusted_m);
      const auto end =
          to_octomap(sweep.poses[i] * Eigen::Vector3d(reach_m * std::sin(angle_rad), 0, reach_m * std::cos(angle_rad)));
      if (tree.computeRayKeys(to_octomap(sweep.poses[i].translation()), end, passed))
        free.insert(passed.begin(), passed.end());
      if (range_m <= kLimits.range_trusted_m) occupied.insert(tree.coordToKey(end));
    }
  }
  for (const octomap::OcTreeKey& key : free) {
    if (occupied.count(key) == 0) tree.updateNode(key, false);
  }
  for (const octomap::OcTreeKey& key : occupied) tree.updateNode(key, true);
}

}  // namespace

TEST_CASE("a sweep of lines is one update, as OctoMap would make it", "[mapping][octomap]") {
  const double resolution_m = GENERATE(0.05, 0.02);
  const GridGeometry geometry = cube(resolution_m);
  VoxelMap map(geometry);
  SweepUpdate update(geometry, kLimits);
  octomap::OcTree tree(resolution_m);
  Random random(8);
  for (int sweep_number = 0; sweep_number < 5; ++sweep_number) {
    const Sweep sweep = random_sweep(random, 40);
    update.begin();
    for (std::size_t i = 0; i < sweep.poses.size(); ++i) REQUIRE(update.add(sweep.line(i)));
    update.apply(map, sweep.poses[20], sweep_number);
    insert_sweep(tree, sweep);
    require_equal(map, tree);
  }
}

TEST_CASE("many lines through one voxel miss it once, line by line they miss it many times", "[mapping]") {
  const GridGeometry geometry = cube(0.05);
  const std::vector<float> wall(1, 2.0F);
  const Transform<Base, Depth> origin(Eigen::Quaterniond::Identity(), {0.025, 0.025, 0.025});
  const auto log_odds_after = [&](bool as_one) {
    VoxelMap map(geometry);
    SweepUpdate update(geometry, kLimits);
    for (int i = 0; i < 10; ++i) {
      REQUIRE(update.add({origin, wall, 0, 0}));
      if (!as_one) update.apply(map, origin, i);
    }
    if (as_one) update.apply(map, origin, 1);
    return map.log_odds(geometry.index(geometry.voxel({0.025, 0.025, 1.0})));
  };
  CHECK(log_odds_after(true) == kMissLogOdds);
  CHECK(log_odds_after(false) == kLogOddsMin);
}

TEST_CASE("sweeps from two places make space known free, and nothing that a surface fills", "[mapping][safety]") {
  const GridGeometry geometry = cube(0.05);
  VoxelMap map(geometry);
  SweepUpdate update(geometry, kLimits);
  // A wall at x = 1: lines fan out about z, the fan tilts.
  for (const double y_m : {-0.1, 0.1}) {
    for (int i = -60; i <= 60; ++i) {
      const Eigen::Quaterniond turn = Eigen::AngleAxisd(0.008 * i, Eigen::Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY());
      const Transform<Base, Depth> pose(turn * Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()),
                                        {0, y_m, 0});
      std::vector<float> ranges;
      for (int k = 0; k < 200; ++k) {
        const double angle = -0.8 + 0.008 * k;
        const Eigen::Vector3d along = pose.rotation() * Eigen::Vector3d(std::sin(angle), 0, std::cos(angle));
        ranges.push_back(static_cast<float>(1.0 / along.x()));
      }
      REQUIRE(update.add({pose, ranges, -0.8, 0.008}));
    }
    update.apply(map, Transform<Base, Depth>(Eigen::Quaterniond::Identity(), {0, y_m, 0}), 1);
  }
  const auto is_free = [&](const Eigen::Vector3d& at_m) {
    return map.known_free(geometry.index(geometry.voxel(at_m)), 2, 600);
  };
  CHECK(is_free({0.6, 0.01, 0.01}));
  CHECK(is_free({0.8, -0.1, 0.1}));
  for (const double y_m : {-0.3, 0.0, 0.3}) {
    CHECK_FALSE(is_free({1.01, y_m, 0.01}));
    CHECK_FALSE(is_free({1.3, y_m, 0.01}));
  }
}

TEST_CASE("a line that cannot be used is refused and leaves the sweep as it is", "[mapping]") {
  SweepUpdate update(cube(0.05), kLimits);
  const std::vector<float> ranges(3, 1.0F);
  Pose broken = Pose::Identity();
  broken.translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(update.add({Transform<Base, Depth>(broken), ranges, 0, 0.1}).error().fault == Fault::kFrameRefused);
  broken = Pose::Identity();
  broken.translation().x() = 1e5;
  CHECK(update.add({Transform<Base, Depth>(broken), ranges, 0, 0.1}).error().fault == Fault::kFrameRefused);
  CHECK(update.add({Transform<Base, Depth>(), ranges, std::numeric_limits<double>::infinity(), 0.1}).error().fault ==
        Fault::kFrameRefused);
  VoxelMap map(cube(0.05));
  CHECK(update.apply(map, Transform<Base, Depth>(), 1).voxels_missed == 0);
}

TEST_CASE("two sensors of different kinds feed one map as OctoMap takes their clouds in turn", "[mapping][octomap]") {
  const GridGeometry geometry = cube(0.05);
  const DepthSensor wide{{64, 48, 40, 40, 31.5, 23.5}, 0.2, 2.5, 2.5, 0};
  const DepthSensor narrow{{48, 48, 90, 90, 23.5, 23.5}, 0.4, 2.0, 2.0, 0.075};
  Inserter first(geometry, wide), second(geometry, narrow);
  VoxelMap map(geometry);
  octomap::OcTree tree(0.05);
  Random random(9);
  for (int i = 0; i < 12; ++i) {
    Inserter& inserter = i % 3 == 0 ? second : first;
    const CameraIntrinsics& c = inserter.sensor().intrinsics;
    std::vector<std::uint16_t> pixels;
    for (int k = 0; k < c.width * c.height; ++k)
      pixels.push_back(static_cast<std::uint16_t>(random.uniform() < 0.1 ? 0 : 1000 * random.uniform(0.9, 2.4)));
    const DepthImage depth{{pixels.data(), c.width, c.height}, 1000};
    const Transform<Base, Depth> pose(random.rotation(), {random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0});
    REQUIRE(inserter.insert(map, depth, pose, {}, i));
    insert_into(tree, depth, c, pose, inserter.sensor().range_max_m);
  }
  require_equal(map, tree);
}

TEST_CASE("two sensors at one time are two viewpoints, a hit of either takes free space away", "[mapping][safety]") {
  const GridGeometry geometry = cube(0.05);
  const DepthSensor sensor{{64, 48, 40, 40, 31.5, 23.5}, 0.2, 2.5, 2.5, 0};
  Inserter left(geometry, sensor), right(geometry, sensor);
  VoxelMap map(geometry);
  std::vector<std::uint16_t> pixels(64 * 48, 1500);
  const DepthImage depth{{pixels.data(), 64, 48}, 1000};
  const Transform<Base, Depth> at_left(Eigen::Quaterniond::Identity(), {-0.1, 0, 0});
  const Transform<Base, Depth> at_right(Eigen::Quaterniond::Identity(), {0.1, 0, 0});
  const std::size_t between = geometry.index(geometry.voxel({0.02, 0.02, 0.62}));
  REQUIRE(left.insert(map, depth, at_left, {}, 10));
  CHECK_FALSE(map.known_free(between, 10, 600));
  REQUIRE(right.insert(map, depth, at_right, {}, 10));
  CHECK(map.known_free(between, 10, 600));
  std::ranges::fill(pixels, std::uint16_t{620});
  REQUIRE(left.insert(map, depth, at_left, {}, 11));
  CHECK_FALSE(map.known_free(between, 11, 600));
}

}  // namespace firstlook
