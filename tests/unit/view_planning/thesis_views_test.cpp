#include "algorithms/view_planning/thesis_views.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/view_planning/small_world.hpp"

using namespace firstlook;
using namespace firstlook::test;

namespace {

/// Rays that first meet, of all that is not free, an unknown voxel of the zone; in steps of a twentieth of a voxel.
std::uint32_t rays_by_steps(const SmallWorld& world, const Transform<Base, Flange>& base_T_flange) {
  std::uint32_t count = 0;
  const Transform<Base, Depth> base_T_depth = base_T_flange * world.mount;
  for (const Eigen::Vector3d& end : GainRays::thesis().ends_m) {
    const int steps = static_cast<int>(end.norm() / 0.0025);
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector3d p = base_T_depth * Eigen::Vector3d(end * (static_cast<double>(i) / steps));
      const Eigen::Vector3i voxel = world.map.geometry().voxel(p);
      if (!world.map.geometry().contains(voxel)) continue;
      const std::size_t index = world.map.geometry().index(voxel);
      if (world.map.voxel_class(index) == VoxelClass::kFree) continue;
      if (world.map.voxel_class(index) == VoxelClass::kUnknown && world.zone[index] == 0) continue;
      count += world.map.voxel_class(index) == VoxelClass::kUnknown ? 1 : 0;
      break;
    }
  }
  return count;
}

void look_around(SmallWorld& world) {
  for (double turn = -3; turn <= 3; turn += 0.75) {
    JointVector q = world.q;
    q[0] += turn;
    world.look(q);
    q[0] += 0.2;
    world.look(q);
  }
  world.update();
}

}  // namespace

TEST_CASE("a pose is scored by its rays that end in unknown space, less the way there", "[thesis]") {
  SmallWorld world(Truth::room());
  for (const double turn : {0.5, 0.9}) {  // only a part of the room is seen
    JointVector q = world.q;
    q[0] += turn;
    world.look(q);
  }
  world.update();
  ThesisOptions options;
  const Transform<Base, Flange> here = forward(world.arm, world.q).flange();
  const Eigen::Vector3d from = here.translation() + Eigen::Vector3d(0.3, 0, 0);
  const ThesisScore score = score_as_thesis(world.context(), here, from, options);
  const std::uint32_t expected = rays_by_steps(world, here);
  REQUIRE(expected > 100);
  CHECK(std::abs(static_cast<double>(score.rays) - expected) < 0.01 * expected);  // steps cut corners
  CHECK(score.value == Approx(score.rays - 0.3 * options.weight_per_m));
}

TEST_CASE("the thesis's views keep to known free space, bring news, and depend on seed and step alone", "[thesis]") {
  Truth truth = Truth::room();
  truth.add_box({0.65, -0.4, -0.3}, {0.75, 0.4, 0.4});
  SmallWorld world(std::move(truth));
  look_around(world);
  Planner planner;
  ThesisOptions options;
  const double before = world.coverage();
  const auto first = choose_as_thesis(world.context(), world.q, planner, options);
  REQUIRE(first);
  REQUIRE(first->outcome == ViewChoice::Outcome::kChosen);
  const auto again = choose_as_thesis(world.context(), world.q, planner, options);
  REQUIRE(again);
  CHECK(again->target == first->target);
  for (options.step = 0; options.step < 12; ++options.step) {
    const auto choice = choose_as_thesis(world.context(), world.q, planner, options);
    REQUIRE(choice);
    if (choice->outcome != ViewChoice::Outcome::kChosen) break;
    CHECK(choice->gain.unknown >= options.rays_min);
    CHECK(choice->path.waypoints.front() == world.q);
    CHECK(choice->path.waypoints.back() == choice->target);
    CHECK(world.entries_into_unknown(choice->path) == 0);
    world.follow(choice->path);
  }
  CHECK(options.step > 3);
  CHECK(world.coverage() > before + 0.02);
}

TEST_CASE("with nothing unknown in reach the thesis's rounds end", "[thesis]") {
  SmallWorld world(Truth::room());
  look_around(world);
  std::ranges::fill(world.zone, std::uint8_t{0});
  Planner planner;
  const auto choice = choose_as_thesis(world.context(), world.q, planner, {});
  REQUIRE(choice);
  CHECK(choice->outcome == ViewChoice::Outcome::kComplete);
  CHECK(choice->worthwhile == 0);
  CHECK(choice->considered == ThesisOptions{}.rounds_max * ThesisOptions{}.candidates);
}
