#include "algorithms/motion/planner.hpp"

#include <catch2/catch.hpp>

#include "random_cell.hpp"

using namespace firstlook;
using namespace firstlook::test;

namespace {

constexpr Clearance kNeed{.voxels_m = 0.06, .surface_m = 0.015};

JointVector free_joints(Random& random, const ArmModel& arm, const Body& body, const FreeSpace& space) {
  for (int i = 0; i < 100000; ++i) {
    JointVector q = random_joints(random, 3.1);
    q[1] = -std::abs(q[1]);  // upper arm above the floor: both sides of it are not connected within the limits
    if (configuration_is_free(arm, body, space, kNeed, q, 0.005)) return q;
  }
  FAIL("no free configuration");
  return {};
}

}  // namespace

TEST_CASE("paths in random cells are found, start and end where asked, and are free along their whole length") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  Planner planner;
  Random random(1);
  int found = 0;
  int straight = 0;
  constexpr int kProblems = 60;
  for (int i = 0; i < kProblems; ++i) {
    const RandomCell cell(static_cast<std::uint64_t>(100 + i / 10), 5);
    FreeSpace space;
    space.field = &cell.field;
    const JointVector start = free_joints(random, arm, body, space);
    const JointVector goal = free_joints(random, arm, body, space);
    const auto path = planner.plan(arm, body, space, kNeed, start, goal);
    if (!path) {
      CHECK(path.error().fault == Fault::kNoPath);
      continue;
    }
    ++found;
    straight += path->waypoints.size() == 2 ? 1 : 0;
    REQUIRE(path->waypoints.front() == start);
    REQUIRE(path->waypoints.back() == goal);
    CHECK(path->duration_s > 0);
    CHECK(path->margin_m >= 0);
    double length = 0;
    for (std::size_t w = 1; w < path->waypoints.size(); ++w) {
      const JointVector& a = path->waypoints[w - 1];
      const JointVector& b = path->waypoints[w];
      length += (b - a).max_abs();
      for (int k = 0; k <= 12; ++k) {
        REQUIRE(sampled_margin_m(arm, body, cell, space, kNeed, interpolate(a, b, k / 12.0), 0.03) >= 0);
      }
    }
    CHECK(path->length_rad == Approx(length));
  }
  CHECK(found >= kProblems * 9 / 10);
  CHECK(straight < found);
}

TEST_CASE("one seed gives one path, another seed may give another") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  Random random(7);
  int planned = 0;
  int differing = 0;
  for (int i = 0; i < 8; ++i) {
    const RandomCell cell(static_cast<std::uint64_t>(200 + i), 7);
    FreeSpace space;
    space.field = &cell.field;
    const JointVector start = free_joints(random, arm, body, space);
    const JointVector goal = free_joints(random, arm, body, space);
    Planner first;
    Planner second;
    PlannerOptions options{.seed = 5};
    const auto a = first.plan(arm, body, space, kNeed, start, goal, options);
    const auto again = first.plan(arm, body, space, kNeed, start, goal, options);
    const auto b = second.plan(arm, body, space, kNeed, start, goal, options);
    options.seed = 6;
    const auto c = second.plan(arm, body, space, kNeed, start, goal, options);
    REQUIRE(a.has_value() == b.has_value());
    REQUIRE(a.has_value() == again.has_value());
    if (!a || !c) continue;
    ++planned;
    REQUIRE(a->waypoints.size() == b->waypoints.size());
    for (std::size_t w = 0; w < a->waypoints.size(); ++w) {
      REQUIRE(a->waypoints[w] == b->waypoints[w]);
      REQUIRE(a->waypoints[w] == again->waypoints[w]);
    }
    CHECK(a->duration_s == b->duration_s);
    const bool same = a->waypoints.size() == c->waypoints.size() &&
                      std::equal(a->waypoints.begin(), a->waypoints.end(), c->waypoints.begin());
    differing += same ? 0 : 1;
  }
  CHECK(planned >= 4);
  CHECK(differing >= 1);
}

TEST_CASE("walled in: no path, and the reason") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  const FreeSpace zone_only;
  Planner planner;
  PlannerOptions options;
  options.iterations_max = 300;
  const JointVector start = default_start(arm);
  const JointVector outside{0, -0.8, 0, 0, 0, 0};
  const auto goal_blocked = planner.plan(arm, body, zone_only, kNeed, start, outside, options);
  REQUIRE_FALSE(goal_blocked);
  CHECK(goal_blocked.error().fault == Fault::kNoPath);
  CHECK(goal_blocked.error().detail().find("goal") != std::string_view::npos);

  const auto start_blocked = planner.plan(arm, body, zone_only, kNeed, outside, start, options);
  REQUIRE_FALSE(start_blocked);
  CHECK(start_blocked.error().fault == Fault::kStartBlocked);
  CHECK(start_blocked.error().detail().find("start: link 3 leaves known free space, ") == 0);

  const Body enveloped = body_with_envelope(arm, 0.45);
  const auto carried_blocked = planner.plan(arm, enveloped, zone_only, kNeed, start, start, options);
  REQUIRE_FALSE(carried_blocked);
  CHECK(carried_blocked.error().detail().find("start: what is carried by link 6 leaves known free space, ") == 0);

  JointVector folded = start;
  folded[2] = 2.9;
  FreeSpace everywhere;
  everywhere.zone = {.radius_m = 9, .height_m = 18, .floor_m = -9};
  const auto meets_itself = planner.plan(arm, enveloped, everywhere, kNeed, folded, start, options);
  REQUIRE_FALSE(meets_itself);
  CHECK(meets_itself.error().detail().find(" meets the arm itself, ") != std::string_view::npos);

  // Both ends free, a wall between them: four planes' worth of boxes cut the space in two at y = 0.
  FreeSpace halved;
  halved.zone.radius_m = 3;
  halved.zone.height_m = 4;
  halved.zone.floor_m = -2;
  halved.keep_out_boxes.push_back({{0.32, -0.01, -3}, {3, 0.01, 3}});
  halved.keep_out_boxes.push_back({{-3, -0.01, -3}, {-0.32, 0.01, 3}});
  halved.keep_out_boxes.push_back({{-0.32, -0.3, 0.45}, {0.32, 0.3, 3}});
  halved.keep_out_boxes.push_back({{-3, -3, -3}, {3, 3, -0.15}});
  const JointVector left{1.57, -0.3, 0.1, 0, 1.57, 0};
  JointVector right = left;
  right[0] = -1.57;
  const auto wall = planner.plan(arm, body, halved, kNeed, left, right, options);
  REQUIRE_FALSE(wall);
  INFO(wall.error().detail());
  CHECK(wall.error().fault == Fault::kNoPath);
  CHECK(wall.error().detail().find("no connection") != std::string_view::npos);
}

TEST_CASE("several goals from one start") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  const RandomCell cell(300, 6);
  FreeSpace space;
  space.field = &cell.field;
  Random random(9);
  Planner planner(1500);
  const JointVector start = free_joints(random, arm, body, space);
  REQUIRE(planner.begin(arm, body, space, kNeed, start, {.seed = 3}));
  int found = 0;
  for (int i = 0; i < 20; ++i) {
    const JointVector goal = free_joints(random, arm, body, space);
    const auto path = planner.plan_to(goal);
    if (!path) continue;
    ++found;
    CHECK(path->waypoints.front() == start);
    CHECK(path->waypoints.back() == goal);
    for (std::size_t w = 1; w < path->waypoints.size(); ++w) {
      CHECK(certify(arm, body, space, kNeed, path->waypoints[w - 1], path->waypoints[w]).certified());
    }
  }
  CHECK(found >= 17);
}

TEST_CASE("the default start: margin in the safe zone with the envelope, and a whole turn of the base") {
  for (const std::string_view name : {"ur3", "ur5", "ur3e", "ur5e"}) {
    const ArmModel arm = *find_arm_model(name);
    const Body body = body_with_envelope(arm);
    const FreeSpace zone_only;
    const Clearance need{.voxels_m = 1, .surface_m = 0.01};
    INFO(name);
    CHECK(configuration_margin(arm, body, zone_only, need, default_start(arm)) >= 0.02);
    JointVector low = default_start(arm);
    JointVector high = low;
    low[0] = -std::numbers::pi;
    high[0] = std::numbers::pi;
    CHECK(certify(arm, body, zone_only, need, low, high).certified());
  }
  for (const std::string_view name : {"ur10", "ur10e"}) {  // larger arms fit just so
    const ArmModel arm = *find_arm_model(name);
    CHECK(configuration_margin(arm, body_with_envelope(arm), {}, {.voxels_m = 1, .surface_m = 0.01},
                               default_start(arm)) >= 0.01);
  }
}

TEST_CASE("the way back along the way out is found without a sample") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  Planner planner;
  Random random(3);
  int back = 0, lost = 0;
  for (int i = 0; i < 40; ++i) {
    const RandomCell cell(static_cast<std::uint64_t>(300 + i / 8), 6);
    FreeSpace space;
    space.field = &cell.field;
    const JointVector start = free_joints(random, arm, body, space);
    const JointVector goal = free_joints(random, arm, body, space);
    const auto out = planner.plan(arm, body, space, kNeed, start, goal);
    if (!out || out->waypoints.size() < 4) continue;
    PlannerOptions options{.seed = 9, .iterations_max = 0};
    lost += planner.plan(arm, body, space, kNeed, goal, start, options) ? 0 : 1;
    const std::vector<JointVector> trail(out->waypoints.begin(), out->waypoints.end());
    options.trail = trail;
    const auto home = planner.plan(arm, body, space, kNeed, goal, start, options);
    REQUIRE(home);
    ++back;
    for (std::size_t w = 1; w < home->waypoints.size(); ++w) {
      for (int k = 0; k <= 12; ++k) {
        const JointVector q = interpolate(home->waypoints[w - 1], home->waypoints[w], k / 12.0);
        REQUIRE(sampled_margin_m(arm, body, cell, space, kNeed, q, 0.03) >= 0);
      }
    }
  }
  CHECK(back >= 5);
  CHECK(lost >= 5);
}
