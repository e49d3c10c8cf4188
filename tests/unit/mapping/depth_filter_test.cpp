#include "algorithms/mapping/depth_filter.hpp"

#include <catch2/catch.hpp>
#include <set>
#include <vector>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

const DepthSensor kSensor{{64, 48, 60, 60, 31.5, 23.5}, 0.3, 5, 3, 0.075};

GridGeometry cube() {
  return GridGeometry::covering(Eigen::Vector3d::Constant(-2), Eigen::Vector3d::Constant(2), 0.05);
}

std::vector<std::uint16_t> random_picture(Random& random) {
  std::vector<std::uint16_t> pixels;
  for (int i = 0; i < 64 * 48; ++i)
    pixels.push_back(static_cast<std::uint16_t>(random.uniform() < 0.1 ? 0 : 1000 * random.uniform(0.4, 4.5)));
  return pixels;
}

Eigen::Vector3d end_of(const Transform<Base, Depth>& pose, int i, std::uint16_t mm) {
  const CameraIntrinsics& c = kSensor.intrinsics;
  return pose * (1e-3 * mm * Eigen::Vector3d((i % 64 - c.cx) / c.fx, (i / 64 - c.cy) / c.fy, 1));
}

}  // namespace

TEST_CASE("the crop leaves out exactly the returns beyond it", "[mapping]") {
  Random random(1);
  DepthFilter filter(cube(), kSensor, {.crop_m = 1.8});
  for (int frame = 0; frame < 5; ++frame) {
    const Transform<Base, Depth> pose(random.rotation(), {random.uniform(-0.3, 0.3), 0.1, 0});
    const auto before = random_picture(random);
    auto after = before;
    const DepthFilterResult result = filter.apply({after.data(), 64, 48}, 1000, pose);
    std::size_t cropped = 0;
    for (int i = 0; i < 64 * 48; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const bool far = before[at] != 0 && (end_of(pose, i, before[at]) - pose.translation()).norm() > 1.8;
      REQUIRE(after[at] == (far ? 0 : before[at]));
      cropped += far ? 1 : 0;
    }
    CHECK(result.pixels_cropped == cropped);
    CHECK(cropped > 500);
    CHECK(result.pixels_thinned == 0);
  }
}

TEST_CASE("the voxel filter keeps one return in each cube, and every cube that had one", "[mapping]") {
  Random random(2);
  const double edge_m = 0.1;
  DepthFilter filter(cube(), kSensor, {.voxel_m = edge_m});
  for (int frame = 0; frame < 5; ++frame) {
    const Transform<Base, Depth> pose(random.rotation(), {random.uniform(-0.3, 0.3), 0.1, 0});
    const auto before = random_picture(random);
    auto after = before;
    const DepthFilterResult result = filter.apply({after.data(), 64, 48}, 1000, pose);
    std::set<std::array<int, 3>> had, kept;
    std::size_t thinned = 0;
    for (int i = 0; i < 64 * 48; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (before[at] == 0 || before[at] < 300) continue;
      const Eigen::Vector3d end_m = end_of(pose, i, before[at]);
      const bool counts = (end_m - pose.translation()).norm() <= 3 && end_m.cwiseAbs().maxCoeff() < 2;
      if (!counts) {
        CHECK(after[at] == before[at]);
        continue;
      }
      const Eigen::Vector3i c = (end_m / edge_m).array().floor().cast<int>();
      had.insert({c.x(), c.y(), c.z()});
      if (after[at] != 0) REQUIRE(kept.insert({c.x(), c.y(), c.z()}).second);
      thinned += after[at] == 0 ? 1 : 0;
    }
    CHECK(kept == had);
    CHECK(result.pixels_thinned == thinned);
    CHECK(thinned > 5);
  }
}

}  // namespace firstlook
