#include "algorithms/vision/lattice.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "algorithms/vision/point_buckets.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;

namespace {

constexpr double kStep_px = 20;

/// Rows and columns, each point a little off its place, in no order.
std::vector<Eigen::Vector2d> grid(Random& random, int columns, int rows, double off_px) {
  std::vector<Eigen::Vector2d> points;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      points.emplace_back(100 + kStep_px * i + off_px * random.normal(), 80 + kStep_px * j + off_px * random.normal());
    }
  }
  for (std::size_t k = points.size(); k > 1; --k) {
    std::swap(points[k - 1], points[static_cast<std::size_t>(random.below(static_cast<int>(k)))]);
  }
  return points;
}

LatticeSeed seed_at(std::size_t point) { return {point, {kStep_px, 0}, {0, kStep_px}}; }

std::vector<LatticePlace> places(int columns, int rows) {
  std::vector<LatticePlace> all;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) all.push_back({i, j});
  }
  return all;
}

bool same(const LatticePoint& a, const LatticePoint& b) { return a.i == b.i && a.j == b.j && a.point == b.point; }

}  // namespace

TEST_CASE("a grower's lattices do not depend on those before", "[vision][lattice]") {
  Random random(1);
  const auto points = grid(random, 12, 9, 0.3);
  const PointIndex index(points, 12);
  LatticeGrower grower(index);
  const auto all_fit = [](std::size_t, std::size_t) { return true; };
  for (std::size_t p = 0; p < points.size(); ++p) {
    const auto again = grower.grow(seed_at(p), {0.3, all_fit, {}});
    LatticeGrower fresh_grower(index);
    const auto fresh = fresh_grower.grow(seed_at(p), {0.3, all_fit, {}});
    REQUIRE(std::equal(again.begin(), again.end(), fresh.begin(), fresh.end(), same));
    REQUIRE(again.size() == points.size());
  }
}

TEST_CASE("a lattice that ends early is one that matches nothing at its full size", "[vision][lattice]") {
  Random random(2);
  const auto all_fit = [](std::size_t, std::size_t) { return true; };
  int ended = 0, matched = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const int columns = 4 + random.below(9), rows = 3 + random.below(8);
    const auto points = grid(random, columns, rows, 1.2);
    const PointIndex index(points, 12);
    LatticeGrower full_grower(index), grower(index);
    const auto wanted = trial % 4 == 0 ? places(columns, rows) : places(4 + random.below(5), 3 + random.below(4));
    const std::size_t size_max = lattice_size_max(wanted.size());
    const auto full = full_grower.grow(seed_at(0), {0.3, all_fit, {}});
    const auto some = grower.grow(seed_at(0), {0.3, all_fit, {}, size_max});
    REQUIRE(std::equal(some.begin(), some.end(), full.begin(), full.begin() + static_cast<long>(some.size()), same));
    if (some.size() < full.size()) {
      ++ended;
      REQUIRE(some.size() > size_max);
      for (int turns = 0; turns < 4; ++turns) REQUIRE(match_lattice(full, wanted, turns, wanted.size() / 4).empty());
    }
    matched += match_lattice(some, wanted, 0).empty() ? 0 : 1;
  }
  CHECK(ended > 50);
  CHECK(matched > 10);
}

TEST_CASE("points nearby are those that all points would show", "[vision][lattice]") {
  Random random(3);
  constexpr int kWidth = 300, kHeight = 200;
  PointBuckets buckets(kWidth, kHeight, 16);
  std::vector<Eigen::Vector2d> points;
  int found = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Eigen::Vector2d at(random.uniform(-20, kWidth + 20), random.uniform(-20, kHeight + 20));
    const double reach_px = random.uniform(0, 12);
    const auto near = [&](const Eigen::Vector2d& p) { return (p - at).cwiseAbs().maxCoeff() <= reach_px; };
    const bool any = std::any_of(points.begin(), points.end(), near);
    REQUIRE(buckets.any_near(at, reach_px, [&](std::size_t p) { return near(points[p]); }) == any);
    found += any ? 1 : 0;
    buckets.add(at);
    points.push_back(at);
  }
  CHECK(found > 200);
  CHECK(found < 1900);
}
