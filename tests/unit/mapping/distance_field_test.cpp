#include "algorithms/mapping/distance_field.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "platform/core/processor.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

std::vector<std::uint8_t> random_mask(const GridGeometry& geometry, double free_fraction, Random& random) {
  std::vector<std::uint8_t> mask(geometry.count());
  for (std::uint8_t& free : mask) free = random.uniform() < free_fraction ? 1 : 0;
  return mask;
}

// Centres of everything that is not free, with the shell of voxels just outside the grid.
std::vector<Eigen::Vector3d> obstacle_centers(const GridGeometry& g, const std::vector<std::uint8_t>& mask) {
  std::vector<Eigen::Vector3d> centers;
  for (int z = -1; z <= g.size.z(); ++z)
    for (int y = -1; y <= g.size.y(); ++y)
      for (int x = -1; x <= g.size.x(); ++x)
        if (const Eigen::Vector3i v(x, y, z); !g.contains(v) || mask[g.index(v)] == 0) centers.push_back(g.center_m(v));
  return centers;
}

double nearest_m(const std::vector<Eigen::Vector3d>& centers, const Eigen::Vector3d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& c : centers) nearest = std::min(nearest, (c - p).squaredNorm());
  return std::sqrt(nearest);
}

}  // namespace

TEST_CASE("distances equal brute force", "[mapping][distance]") {
  Random random(3);
  const GridGeometry geometry{0.05, {-7, 3, -2}, {13, 9, 11}};
  DistanceField field(geometry, 10);
  for (const double fraction : {0.0, 0.5, 0.9, 0.98, 0.998, 1.0}) {
    const std::vector<std::uint8_t> mask = random_mask(geometry, fraction, random);
    const std::vector<Eigen::Vector3d> centers = obstacle_centers(geometry, mask);
    field.update(mask);
    for (std::size_t i = 0; i < geometry.count(); ++i) {
      const double expected_m = nearest_m(centers, geometry.center_m(geometry.voxel_at(i)));
      REQUIRE(static_cast<double>(field.values()[i]) == Approx(expected_m).margin(1e-6));
    }
  }
}

TEST_CASE("after any sequence of changes distances equal brute force, cut at the maximum", "[mapping][distance]") {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Random random(seed, 5);
    const GridGeometry geometry{0.05, {-7, 3, -2}, {6 + random.below(14), 5 + random.below(9), 5 + random.below(9)}};
    const double distance_max_m = seed % 3 == 0 ? 10 : random.uniform(0.06, 0.4);
    DistanceField field(geometry, distance_max_m);
    std::vector<std::uint8_t> mask(geometry.count(), 0);
    for (int step = 0; step < 12; ++step) {
      // Frees or takes a box, or single voxels all over.
      const bool free = random.uniform() < (step < 4 ? 0.9 : 0.5), box = random.uniform() < 0.6;
      const Eigen::Vector3i low(random.below(geometry.size.x()), random.below(geometry.size.y()),
                                random.below(geometry.size.z()));
      const Eigen::Vector3i high = low + Eigen::Vector3i(random.below(15), random.below(9), random.below(9));
      for (std::size_t i = 0; i < mask.size(); ++i) {
        const Eigen::Vector3i v = geometry.voxel_at(i);
        const bool inside = (v.array() >= low.array()).all() && (v.array() <= high.array()).all();
        if (box ? inside : random.uniform() < 0.02) mask[i] = free ? 1 : 0;
      }
      field.update(mask);
      const std::vector<Eigen::Vector3d> centers = obstacle_centers(geometry, mask);
      for (std::size_t i = 0; i < geometry.count(); ++i) {
        const double expected_m = std::min(distance_max_m, nearest_m(centers, geometry.center_m(geometry.voxel_at(i))));
        INFO("seed " << seed << " step " << step << " voxel " << i);
        REQUIRE(static_cast<double>(field.values()[i]) == Approx(expected_m).margin(1e-6));
      }
    }
  }
}

TEST_CASE("an update computes only what a change can reach, with AVX2 and without", "[mapping][distance]") {
  const GridGeometry geometry{0.05, {0, 0, 0}, {40, 60, 50}};
  DistanceField field(geometry, 0.2), portable(geometry, 0.2);
  std::vector<std::uint8_t> mask(geometry.count(), 1);
  CHECK(field.update(mask) == 60 * 50);
  CHECK(field.update(mask) == 0);
  mask[geometry.index({20, 30, 25})] = 0;
  const std::size_t rows = field.update(mask);
  CHECK(rows > 0);
  CHECK(rows <= 9 * 9);  // 0.2 m are four voxels to each side
  {
    const PortableOnly without_avx2;
    portable.update(mask);
  }
  CHECK(std::equal(field.values().begin(), field.values().end(), portable.values().begin()));
}

TEST_CASE("the distance of any point is a lower bound, and a tight one", "[mapping][distance][safety]") {
  Random random(4);
  const GridGeometry geometry{0.05, {-10, -10, -4}, {20, 20, 16}};
  DistanceField field(geometry, 10);
  double loss_sum_m = 0;
  int points = 0;
  for (const double fraction : {0.7, 0.97, 0.999}) {
    const std::vector<std::uint8_t> mask = random_mask(geometry, fraction, random);
    const std::vector<Eigen::Vector3d> centers = obstacle_centers(geometry, mask);
    field.update(mask);
    for (int i = 0; i < 3000; ++i) {
      const Eigen::Vector3d p(random.uniform(-0.55, 0.55), random.uniform(-0.55, 0.55), random.uniform(-0.25, 0.65));
      const double expected_m = nearest_m(centers, p), bound_m = field.distance_m(p);
      REQUIRE(bound_m <= expected_m);
      REQUIRE(bound_m >= 0);
      if (!geometry.contains(geometry.voxel(p))) {
        REQUIRE(bound_m == 0);
        continue;
      }
      loss_sum_m += expected_m - bound_m;
      ++points;
    }
  }
  CHECK(loss_sum_m / points <
        0.015);  // a third of a voxel, in clutter where nearest obstacles change from voxel to voxel
}

TEST_CASE("the distance is continuous across voxels", "[mapping][distance]") {
  Random random(8);
  const GridGeometry geometry{0.05, {0, 0, 0}, {12, 12, 12}};
  DistanceField field(geometry, 10);
  field.update(random_mask(geometry, 0.98, random));
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p(random.uniform(0.05, 0.55), random.uniform(0.05, 0.55), random.uniform(0.05, 0.55));
    const double d_m = field.distance_m(p);
    if (d_m < 0.02) continue;  // the root is steep at zero
    REQUIRE(std::abs(field.distance_m(p + 1e-6 * random.direction()) - d_m) < 1e-5);
  }
}

TEST_CASE("distances are cut at the maximum and outside nothing is free", "[mapping][distance][hostile]") {
  const GridGeometry geometry{0.1, {0, 0, 0}, {20, 20, 20}};
  DistanceField field(geometry, 0.35);
  CHECK(field.distance_m({1, 1, 1}) == 0);  // before the first update nothing is free
  field.update(std::vector<std::uint8_t>(geometry.count(), 1));
  CHECK(field.distance_m({1.05, 1.05, 1.05}) == Approx(0.35).margin(1e-5));
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  for (const double bad : {-0.001, 2.0, 1e12, nan, infinite, -infinite}) CHECK(field.distance_m({1, bad, 1}) == 0);
}

TEST_CASE("a copy into a field of the same geometry keeps its memory", "[mapping][distance]") {
  const GridGeometry geometry{0.1, {0, 0, 0}, {10, 10, 10}};
  DistanceField field(geometry, 1), snapshot(geometry, 1);
  field.update(std::vector<std::uint8_t>(geometry.count(), 1));
  const float* memory = snapshot.values().data();
  snapshot = field;
  CHECK(snapshot.values().data() == memory);
  CHECK(snapshot.distance_m({0.5, 0.5, 0.5}) == field.distance_m({0.5, 0.5, 0.5}));
  CHECK(DistanceField::required_bytes(geometry) >= geometry.count() * 8);
}

}  // namespace firstlook
