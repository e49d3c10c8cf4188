#include "algorithms/mapping/end_octants.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <vector>

#include "algorithms/mapping/octants.hpp"
#include "algorithms/mapping/ray_marker.hpp"
#include "platform/core/processor.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

constexpr int kWidth = 101, kHeight = 40;  // no whole number of vectors
constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;

struct Ends {
  std::set<std::int32_t> octants;
  std::vector<float> reach_m;
  PixelCounts counts;
};

struct Setting {
  GridGeometry geometry;
  DepthSensor sensor;
  Transform<Base, Depth> pose;
  std::vector<std::uint16_t> values;
  std::vector<float> self_m;
  [[nodiscard]] DepthImage depth() const { return {{values.data(), kWidth, kHeight}, 1000}; }
};

/// In doubles, point by point.
Ends as_depth_rays_has_them(const Setting& s) {
  DepthRays rays(s.sensor);
  Ends ends;
  ends.counts = rays.for_each_row(s.depth(), s.pose, s.self_m, [&](int, const RayRow& row) {
    for (std::size_t u = 0; u < row.kind.size(); ++u) {
      ends.reach_m.push_back(row.kind[u] <= PixelKind::kBeyond ? row.reach_m[u] : RangeImage::kNoRay);
      const Eigen::Vector3f end_m(row.end_x_m[u], row.end_y_m[u], row.end_z_m[u]);
      if (row.kind[u] != PixelKind::kHit || !s.geometry.contains(octomap_voxel(s.geometry, end_m))) continue;
      const std::size_t voxel = s.geometry.index(octomap_voxel(s.geometry, end_m));
      ends.octants.insert(static_cast<std::int32_t>(8 * voxel + octant_of(s.geometry, end_m)));
    }
  });
  return ends;
}

Ends found(const Setting& s) {
  const DepthRays rays(s.sensor);
  EndOctants finder(s.geometry, s.sensor);
  RangeImage image(kWidth, kHeight);
  Ends ends;
  ends.counts = finder.find(rays, s.depth(), s.pose, s.self_m, image,
                            [&](std::span<const std::int32_t> row) { ends.octants.insert(row.begin(), row.end()); });
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) ends.reach_m.push_back(image.at(u, v));
  }
  return ends;
}

void require_same(const Ends& ours, const Ends& theirs) {
  REQUIRE(ours.octants == theirs.octants);
  REQUIRE(ours.counts.pixels_used == theirs.counts.pixels_used);
  REQUIRE(ours.counts.pixels_beyond == theirs.counts.pixels_beyond);
  REQUIRE(ours.counts.pixels_empty == theirs.counts.pixels_empty);
  REQUIRE(ours.counts.pixels_too_near == theirs.counts.pixels_too_near);
  REQUIRE(ours.counts.pixels_self == theirs.counts.pixels_self);
  int different = 0;
  for (std::size_t i = 0; i < kPixels; ++i) different += std::abs(ours.reach_m[i] - theirs.reach_m[i]) > 2e-6F;
  REQUIRE(different == 0);
}

DepthSensor sensor_of(double focal_px, double range_m) {
  DepthSensor sensor;
  sensor.intrinsics = {kWidth, kHeight, focal_px, focal_px, 50, 20};
  sensor.range_min_m = 0.4;
  sensor.range_max_m = sensor.range_trusted_m = range_m;
  return sensor;
}

}  // namespace

TEST_CASE("ends found in floats are those of the doubles, with AVX2 and without", "[mapping]") {
  std::size_t octants = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed, 41);
    Setting s;
    const double resolution_m = seed % 4 == 0 ? 0.01 : random.uniform(0.02, 0.1);
    const Eigen::Vector3d low_m(random.uniform(-3, 0), random.uniform(-3, 0), random.uniform(-3, 0));
    s.geometry = GridGeometry::covering(low_m, low_m + Eigen::Vector3d::Constant(3), resolution_m);
    s.sensor = sensor_of(random.uniform(50, 300), random.uniform(1, 5));
    s.pose = {random.rotation(), 2 * random.direction()};
    const double wall_m = random.uniform(0.3, 6);
    for (std::size_t i = 0; i < kPixels; ++i) {
      const bool hole = random.uniform() < 0.1;
      s.values.push_back(hole ? std::uint16_t{0}
                              : static_cast<std::uint16_t>(1000 * wall_m * random.uniform(0.9, 1.1)));
    }
    if (seed % 3 == 0) s.self_m.assign(kPixels, static_cast<float>(wall_m));
    const Ends exact = as_depth_rays_has_them(s);
    INFO("seed " << seed);
    require_same(found(s), exact);
    const PortableOnly without_avx2;
    require_same(found(s), exact);
    octants += exact.octants.size();
  }
  CHECK(octants > 10000);
}

TEST_CASE("ends on faces, at the range and at the arm's own depth are decided as the doubles decide", "[mapping]") {
  for (const double offset_m : {0.0, 0.05, 0.025, 1e-7, -1e-7, 1e-4}) {
    for (const std::uint16_t value : {std::uint16_t{400}, std::uint16_t{1000}, std::uint16_t{1100}}) {
      Setting s;
      s.geometry = GridGeometry::covering(Eigen::Vector3d::Constant(-1.5), Eigen::Vector3d::Constant(1.5), 0.05);
      s.sensor = sensor_of(100, 1.1);
      s.pose = {Eigen::Quaterniond::Identity(), Eigen::Vector3d::Constant(offset_m)};
      s.values.assign(kPixels, value);
      require_same(found(s), as_depth_rays_has_them(s));
      s.self_m.assign(kPixels, static_cast<float>(value) / 1000);
      require_same(found(s), as_depth_rays_has_them(s));
    }
  }
}

}  // namespace firstlook
