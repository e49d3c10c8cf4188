#include "algorithms/motion/free_space.hpp"

#include <catch2/catch.hpp>

#include "random_cell.hpp"

using namespace firstlook;
using namespace firstlook::test;

TEST_CASE("before anything is mapped only the zone is free") {
  const FreeSpace space;
  CHECK(space.clearance_m({0, 0, 0.5}) == Approx(0.5));
  CHECK(space.clearance_m({0.4, 0, 0.5}) == Approx(0.1));
  CHECK(space.clearance_m({0, 0, 1.10}) == Approx(0.03));
  CHECK(space.clearance_m({0, 0, 0.03}) == Approx(0.05));
  CHECK(space.clearance_m({0.6, 0, 0.5}) <= 0);
  FreeSpace revoked;
  revoked.zone_intact = false;
  CHECK(revoked.clearance_m({0, 0, 0.5}) <= 0);
}

TEST_CASE("zone and map are united, each with its own requirement") {
  const RandomCell cell(5, 0);
  FreeSpace space;
  space.field = &cell.field;
  const Clearance need{.voxels_m = 0.06, .surface_m = 0.01};
  const Eigen::Vector3d beside(0.8, 0, 0.6);  // outside the zone, in mapped free space
  CHECK(space.zone_margin_m(beside, need) < 0);
  CHECK(space.margin_m(beside, need) > 0.2);
  const Eigen::Vector3d low(0.1, 0, 0.02);  // the floor's voxels are nearer than the zone's floor
  CHECK(space.field_margin_m(low, need) < space.zone_margin_m(low, need));
  CHECK(space.margin_m(low, need) == Approx(0.03));
  space.zone_intact = false;
  CHECK(space.margin_m(low, need) == Approx(space.field_margin_m(low, need)));
}

TEST_CASE("a ball of the margin's radius is free everywhere and out of every keep-out") {
  const RandomCell cell(6, 8);
  FreeSpace space;
  space.field = &cell.field;
  space.keep_out_boxes.push_back({{0.2, 0.2, 0.2}, {0.4, 0.5, 0.6}});
  space.keep_out_planes.push_back({Eigen::Vector3d(0, -1, 0), -0.7});
  Random random(1);
  int free_points = 0;
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d p(random.uniform(-1.2, 1.2), random.uniform(-1.2, 1.2), random.uniform(-0.2, 1.4));
    const double clearance = space.clearance_m(p);
    if (clearance <= 0) continue;
    ++free_points;
    const Eigen::Vector3d q = p + random.direction() * clearance * 0.999;
    const bool in_zone = space.zone.depth_m(q) >= 0;
    const bool voxel_centre_near = cell.exact_distance_m(q, 0.3) <= 0;
    CHECK((in_zone || !voxel_centre_near));
    CHECK(space.keep_out_boxes[0].distance_m(q) > 0);
    CHECK(q.y() < 0.7);
    // Either reading alone must allow the whole ball.
    CHECK((space.zone.depth_m(p) >= clearance || cell.exact_distance_m(p, 0.7) >= clearance - 1e-6));
  }
  CHECK(free_points > 500);
}
