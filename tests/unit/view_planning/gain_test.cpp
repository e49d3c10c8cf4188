#include "algorithms/view_planning/gain.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/view_planning/small_world.hpp"

using namespace firstlook;
using namespace firstlook::test;

TEST_CASE("a look makes known most of what it was expected to", "[gain]") {
  SmallWorld world(Truth::room());
  GainModel model(world.map.geometry(), world.sensor);
  GainWorker worker = model.worker();
  model.prepare(world.context());
  const ViewGain expected = model.count(world.context(), world.q, worker);
  REQUIRE(expected.unknown > 1000);
  REQUIRE(expected.again == 0);
  world.look(world.q);
  world.update();
  model.prepare(world.context());
  const ViewGain rest = model.count(world.context(), world.q, worker);
  REQUIRE(rest.unknown < 0.05 * expected.unknown);
}

TEST_CASE("what was seen once needs a second pose for motion, and counts as that", "[gain]") {
  SmallWorld world(Truth::room());
  GainModel model(world.map.geometry(), world.sensor);
  GainWorker worker = model.worker();
  world.look(world.q);
  world.update();
  model.prepare(world.context());
  JointVector beside = world.q;
  beside[0] += 0.1;
  const ViewGain second = model.count(world.context(), beside, worker);
  REQUIRE(second.again > 1000);
  world.look(beside);
  world.update();
  model.prepare(world.context());
  REQUIRE(model.count(world.context(), beside, worker).again < 0.3 * second.again);
  beside[3] += 0.02;  // the rays of its few pixels cross octants that lay between them
  world.look(beside);
  world.update();
  model.prepare(world.context());
  REQUIRE(model.count(world.context(), beside, worker).again < 0.2 * second.again);
}

TEST_CASE("the arm in front of the sensor hides what is behind it", "[gain]") {
  SmallWorld world(Truth::room());
  GainModel model(world.map.geometry(), world.sensor);
  GainWorker worker = model.worker();
  model.prepare(world.context());
  const std::uint32_t open = model.count(world.context(), world.q, worker).unknown;
  // A plate 0.3 m in front of the flange, carried by it, that fills half of the view.
  world.body.capsules.push_back({.a = {-0.25, -0.4, 0.3}, .b = {-0.25, 0.4, 0.3}, .radius_m = 0.25, .link = 6});
  const std::uint32_t hidden = model.count(world.context(), world.q, worker).unknown;
  REQUIRE(hidden < 0.8 * open);
  REQUIRE(hidden > 0);
}

TEST_CASE("voxels that never answer stop attracting", "[gain]") {
  SmallWorld world(Truth{});  // nothing anywhere: no returns, nothing is cleared
  GainModel model(world.map.geometry(), world.sensor);
  GainWorker worker = model.worker();
  model.prepare(world.context());
  const std::uint32_t before = model.count(world.context(), world.q, worker).unknown;
  for (int i = 0; i < model.sampling().futile_max; ++i) {
    world.look(world.q);
    world.update();
    REQUIRE(model.remember_look(world.context(), world.q, worker) > 100);
  }
  model.prepare(world.context());
  REQUIRE(before > 1000);
  REQUIRE(model.count(world.context(), world.q, worker).unknown < 0.02 * before);
}

TEST_CASE("the frontier is unknown and touches free space", "[gain]") {
  SmallWorld world(Truth::room());
  GainModel model(world.map.geometry(), world.sensor);
  model.prepare(world.context());
  REQUIRE(model.frontier().empty());
  world.look(world.q);
  world.update();
  model.prepare(world.context());
  REQUIRE_FALSE(model.frontier().empty());
  for (const std::uint32_t i : model.frontier()) {
    REQUIRE(world.map.voxel_class(i) == VoxelClass::kUnknown);
    REQUIRE(world.zone[i] == 1);
  }
}

TEST_CASE("an earlier map says where to look first, and nothing else", "[gain]") {
  SmallWorld world(Truth::room());
  VoxelMap prior(world.map.geometry(), VoxelMap::Planes::kLogOddsOnly);
  for (std::size_t i = 0; i < prior.size(); ++i)
    prior.set(i, i % 3 == 0 ? VoxelClass::kOccupied : VoxelClass::kFree, 0);
  GainModel model(world.map.geometry(), world.sensor);
  model.allow_prior();
  GainWorker worker = model.worker();
  JointVector beside = world.q;
  beside[0] += 0.1;
  std::uint32_t expected_before = 0;
  for (int look = 0; look < 2; ++look) {
    INFO("after " << look << " looks");
    model.prepare(world.context());
    const ViewGain without = model.count(world.context(), beside, worker);
    const std::vector<std::uint32_t> frontier(model.frontier().begin(), model.frontier().end());
    ViewContext hinted = world.context();
    hinted.prior = &prior;
    model.prepare(hinted);
    const ViewGain with = model.count(hinted, beside, worker);
    REQUIRE(with.unknown == without.unknown);
    REQUIRE(with.again == without.again);
    REQUIRE(without.expected_surface == 0);
    REQUIRE(std::equal(frontier.begin(), frontier.end(), model.frontier().begin(), model.frontier().end()));
    if (look == 0) {
      expected_before = with.expected_surface;
      REQUIRE(with.expected_surface > 0.25 * with.unknown);
      REQUIRE(with.expected_surface < 0.42 * with.unknown);
      REQUIRE(with.weight() == without.weight() + with.expected_surface);
      world.look(beside);
      world.update();
    } else {
      REQUIRE(with.expected_surface < 0.05 * expected_before);  // seen: nothing is expected there any more
    }
  }
}
