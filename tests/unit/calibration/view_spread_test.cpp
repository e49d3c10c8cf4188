#include "algorithms/calibration/view_spread.hpp"

#include <catch2/catch.hpp>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

JointVector at(double first_rad, double second_rad) {
  JointVector q = JointVector::zero(6);
  q[0] = first_rad;
  q[1] = second_rad;
  return q;
}

}  // namespace

TEST_CASE("views near a later one are left out", "[calibration]") {
  const std::vector<JointVector> views{at(0, 0), at(1, 0), at(0.1, 0.1), at(2, 0), at(2, 0.34), at(2, 0.7)};
  CHECK(spread_views(views) == std::vector<std::size_t>{1, 2, 4, 5});
  CHECK(spread_views(views, 0) == std::vector<std::size_t>{0, 1, 2, 3, 4, 5});
  CHECK(spread_views({}).empty());
}

TEST_CASE("what is kept is apart, what is left out is near something kept", "[calibration]") {
  Random random(5);
  std::vector<JointVector> views;
  for (int i = 0; i < 200; ++i) views.push_back(at(random.uniform(-1, 1), random.uniform(-1, 1)));
  const auto kept = spread_views(views);
  for (std::size_t i = 0; i < views.size(); ++i) {
    int near = 0;
    for (const std::size_t k : kept) near += k != i && joint_distance_rad(views[i], views[k]) < kSharedDeviation_rad;
    const bool is_kept = std::find(kept.begin(), kept.end(), i) != kept.end();
    CHECK((near == 0) == is_kept);
  }
}

}  // namespace firstlook
