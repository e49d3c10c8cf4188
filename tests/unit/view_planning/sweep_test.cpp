#include "algorithms/view_planning/sweep.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/view_planning/small_world.hpp"

using namespace firstlook;
using namespace firstlook::test;

TEST_CASE("the sweep looks all around on certified paths and then ends", "[sweep]") {
  Truth truth = Truth::room();
  truth.add_box({0.6, -0.6, -0.3}, {1.0, 0.6, 0.1});
  SmallWorld world(truth);
  GainModel gain(world.map.geometry(), world.sensor);
  GainWorker worker = gain.worker();
  Planner planner;
  SweepProgress progress = plan_sweep(world.arm, world.q, 0.99);
  REQUIRE(progress.steps.size() > 9);
  world.look(world.q);
  world.update();
  int steps = 0;
  for (;; ++steps) {
    REQUIRE(steps <= static_cast<int>(progress.steps.size()));
    const auto step = next_sweep_step(progress, world.context(), gain, worker, planner, world.q);
    REQUIRE(step);
    if (step->done) break;
    REQUIRE(step->gain.unknown >= 800);  // 0.1 m^3
    REQUIRE(step->path.waypoints.front() == world.q);
    REQUIRE(step->path.waypoints.back() == step->target);
    REQUIRE(world.entries_into_unknown(step->path) == 0);
    world.follow(step->path);
  }
  INFO(steps << " steps, coverage " << world.coverage());
  REQUIRE(steps >= 6);
  REQUIRE(steps < static_cast<int>(progress.steps.size()));  // the adaptive part: some were not worth it
  REQUIRE(world.coverage() > 0.5);
}

TEST_CASE("an arm that does not stand free is not swept", "[sweep]") {
  SmallWorld world(Truth::room());
  world.space.zone_intact = false;
  world.space.field = nullptr;
  GainModel gain(world.map.geometry(), world.sensor);
  GainWorker worker = gain.worker();
  Planner planner;
  SweepProgress progress = plan_sweep(world.arm, world.q, 0.99);
  const auto step = next_sweep_step(progress, world.context(), gain, worker, planner, world.q);
  REQUIRE_FALSE(step);
  REQUIRE(step.error().fault == Fault::kStartBlocked);
}
