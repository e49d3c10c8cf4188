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

TEST_CASE("what looks into the open did not tell is still asked of rays with a surface behind", "[gain]") {
  SmallWorld world(Truth{});
  GainModel model(world.map.geometry(), world.sensor);
  GainWorker worker = model.worker();
  const auto gain = [&] {
    model.prepare(world.context());
    return model.count(world.context(), world.q, worker);
  };
  const std::uint32_t before = gain().unknown;
  model.remember_look(world.context(), world.q, worker);
  REQUIRE(gain().unknown < 0.02 * before);
  // A wall, as if seen from elsewhere, where the sensor looks.
  const Eigen::Vector3d axis = (forward(world.arm, world.q).flange() * world.mount).rotation().col(2);
  REQUIRE(axis.x() > 0.5);
  const GridGeometry& g = world.map.geometry();
  std::size_t wall = 0;
  for (std::size_t i = 0; i < world.map.size(); ++i) {
    if (g.center_m(g.voxel_at(i)).x() > 1.4) world.map.set(i, VoxelClass::kOccupied, 0), wall = i;
  }
  REQUIRE(wall > 0);
  CHECK(gain().unknown < 0.02 * before);  // nothing is known to return at all
  std::vector<std::uint16_t> far(static_cast<std::size_t>(world.sensor.intrinsics.width) *
                                     static_cast<std::size_t>(world.sensor.intrinsics.height),
                                 4000);
  model.learn_returns({{far.data(), world.sensor.intrinsics.width, world.sensor.intrinsics.height}, 1000},
                      forward(world.arm, world.q).flange() * world.mount, {});
  const std::uint32_t backed = gain().unknown;
  CHECK(backed > 100);  // a quarter of the rays, the first voxel of each
  model.remember_look(world.context(), world.q, worker);
  CHECK(gain().unknown < 0.05 * before);  // they did not tell, either
}

TEST_CASE("what only rays into the open would tell is doubtful, and weighs little", "[gain]") {
  SmallWorld world(Truth{});
  GainModel model(world.map.geometry(), world.sensor);
  GainWorker worker = model.worker();
  model.prepare(world.context());
  const ViewGain before = model.count(world.context(), world.q, worker);
  REQUIRE(before.unknown > 1000);
  CHECK(before.doubtful == 0);
  const std::vector<std::uint16_t> nothing(static_cast<std::size_t>(world.sensor.intrinsics.width) *
                                           static_cast<std::size_t>(world.sensor.intrinsics.height));
  model.learn_returns({{nothing.data(), world.sensor.intrinsics.width, world.sensor.intrinsics.height}, 1000},
                      forward(world.arm, world.q).flange() * world.mount, {});
  const ViewGain after = model.count(world.context(), world.q, worker);
  CHECK(after.unknown == before.unknown);  // it is still there; what ends exploration asks for the rest
  CHECK(after.doubtful > 0.8 * after.unknown);
  CHECK(after.weight() < 0.3 * before.weight());
}

TEST_CASE("specks of unknown voxels count nothing, clusters do", "[gain]") {
  for (const int edge : {1, 2}) {  // 1 or 8 voxels
    SmallWorld world(Truth::room());
    const GridGeometry& g = world.map.geometry();
    for (std::size_t i = 0; i < world.map.size(); ++i) world.map.set(i, VoxelClass::kFree, 0);
    const Transform<Base, Depth> eye = forward(world.arm, world.q).flange() * world.mount;
    const Eigen::Vector3i at = g.voxel(eye * Eigen::Vector3d(0, 0, 0.9));
    for (int k = 0; k < edge * edge * edge; ++k) {
      const std::size_t i = g.index(at + Eigen::Vector3i(k % edge, k / edge % edge, k / edge / edge));
      REQUIRE(world.zone[i] == 1);
      world.map.set(i, VoxelClass::kUnknown, 0);
    }
    GainModel model(g, world.sensor);
    GainWorker worker = model.worker();
    model.prepare(world.context());
    const std::uint32_t unknown = model.count(world.context(), world.q, worker).unknown;
    if (edge == 1) CHECK(unknown == 0);
    if (edge == 2) CHECK(unknown >= 4);
    CHECK(model.unknown() == static_cast<std::size_t>(edge * edge * edge));
  }
}

TEST_CASE("a voxel that a surface half fills hides what is behind it", "[gain]") {
  SmallWorld world(Truth::room());
  const GridGeometry& g = world.map.geometry();
  for (std::size_t i = 0; i < world.map.size(); ++i) world.map.set(i, VoxelClass::kFree, 0);
  const Transform<Base, Depth> eye = forward(world.arm, world.q).flange() * world.mount;
  // Three unknown voxels deep behind a layer of free ones, all across the optical axis.
  const Eigen::Vector3i at = g.voxel(eye * Eigen::Vector3d(0, 0, 0.9));
  std::vector<std::size_t> layer;
  for (int a = -2; a <= 2; ++a) {
    for (int b = -2; b <= 2; ++b) {
      for (int deep = 0; deep < 3; ++deep)
        world.map.set(g.index(at + Eigen::Vector3i(deep, a, b)), VoxelClass::kUnknown, 0);
    }
  }
  const Eigen::Vector3i box_low = at + Eigen::Vector3i(-1, -3, -3), box_high = at + Eigen::Vector3i(3, 3, 3);
  for (int x = box_low.x(); x <= box_high.x(); ++x) {
    for (int y = box_low.y(); y <= box_high.y(); ++y) {
      for (int z = box_low.z(); z <= box_high.z(); ++z) {
        const Eigen::Vector3i v(x, y, z);
        const bool shell = (v.array() == box_low.array() || v.array() == box_high.array()).any();
        if (shell) layer.push_back(g.index(v));
      }
    }
  }
  GainModel model(g, world.sensor);
  GainWorker worker = model.worker();
  model.prepare(world.context());
  REQUIRE(model.count(world.context(), world.q, worker).unknown > 50);
  for (const std::size_t i : layer) world.map.note_surface(i, 0);  // edges
  model.prepare(world.context());
  CHECK(model.count(world.context(), world.q, worker).unknown > 50);
  for (const std::size_t i : layer) {
    for (const unsigned octant : {1U, 2U}) world.map.note_surface(i, octant);
  }
  model.prepare(world.context());
  CHECK(model.count(world.context(), world.q, worker).unknown == 0);
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

TEST_CASE("a look that is assumed counts no more, the others count what it leaves, and nothing stays of it", "[gain]") {
  SmallWorld world(Truth::room());
  world.look(world.q);
  world.update();
  GainModel gain(world.map.geometry(), world.sensor);
  GainWorker worker = gain.worker();
  JointVector there = world.q, aside = world.q, away = world.q;
  there[0] += 0.5;
  aside[0] += 0.8;
  away[0] -= 1.5;
  gain.prepare(world.context());
  const auto count = [&](const JointVector& q) { return gain.count(world.context(), q, worker).unknown; };
  const std::uint32_t there_before = count(there), aside_before = count(aside), away_before = count(away);
  const std::vector<std::uint32_t> frontier(gain.frontier().begin(), gain.frontier().end());
  REQUIRE(there_before > 100);
  REQUIRE(gain.assume_look(world.context(), there, worker));
  CHECK(count(there) == 0);
  CHECK(count(aside) < aside_before);
  CHECK(count(aside) > 0);
  CHECK(count(away) == away_before);
  CHECK(gain.frontier().size() < frontier.size());
  gain.prepare(world.context());
  CHECK(count(there) == there_before);
  CHECK(std::ranges::equal(gain.frontier(), frontier));
}

TEST_CASE("what is counted at most is all of it, as if nothing were doubtful", "[gain]") {
  SmallWorld world(Truth::room());
  world.look(world.q);
  world.update();
  GainModel gain(world.map.geometry(), world.sensor);
  // A frame without any return: what lies beyond the map is open there.
  const CameraIntrinsics& c = world.sensor.intrinsics;
  const std::vector<std::uint16_t> nothing(static_cast<std::size_t>(c.width * c.height), 0);
  const auto base_T_depth = forward(world.arm, world.q).flange() * world.mount;
  gain.learn_returns({{nothing.data(), c.width, c.height}, 1000}, base_T_depth, {});
  GainWorker worker = gain.worker();
  gain.prepare(world.context());
  bool some_doubtful = false;
  for (const double turn : {0.0, 0.3, 0.6, 1.2}) {
    JointVector q = world.q;
    q[0] += turn;
    const ViewGain whole = gain.count(world.context(), q, worker);
    const ViewGain at_most = gain.count_at_most(world.context(), q, worker);
    CHECK(at_most.unknown == whole.unknown);
    CHECK(at_most.again == whole.again);
    CHECK(at_most.doubtful + at_most.doubtful_again == 0);
    CHECK((at_most.weight() > whole.weight()) == (whole.doubtful + whole.doubtful_again > 0));
    some_doubtful = some_doubtful || whole.doubtful > 0;
  }
  CHECK(some_doubtful);
}
