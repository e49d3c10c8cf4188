#include "algorithms/view_planning/remaining_reason.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/view_planning/small_world.hpp"

using namespace firstlook;
using namespace firstlook::test;

namespace {

/// A map in which all is free but what the test says.
void set_all_free(SmallWorld& world) {
  for (std::size_t i = 0; i < world.map.size(); ++i) {
    const Eigen::Vector3d p = world.map.geometry().center_m(world.map.geometry().voxel_at(i));
    world.map.set(i, p.z() < -0.1 ? VoxelClass::kOccupied : VoxelClass::kFree, 0);
  }
}
void set_box(SmallWorld& world, const Eigen::Vector3d& low, const Eigen::Vector3d& high, VoxelClass voxel) {
  for (std::size_t i = 0; i < world.map.size(); ++i) {
    const Eigen::Vector3d p = world.map.geometry().center_m(world.map.geometry().voxel_at(i));
    if ((p.array() > low.array()).all() && (p.array() < high.array()).all()) world.map.set(i, voxel, 0);
  }
}

std::vector<RemainingEntry> explain(SmallWorld& world, const GainModel& gain, std::size_t voxels_min = 4) {
  world.update();
  const auto clusters = find_remaining(world.map, world.zone, voxels_min);
  REQUIRE(clusters.size() == 1);
  return explain_remaining(world.context(), gain, clusters);
}

}  // namespace

TEST_CASE("in the open a cluster is only out of reach of the certified paths", "[remaining_reason]") {
  SmallWorld world(Truth::room());
  set_all_free(world);
  set_box(world, {0.7, -0.1, 0.3}, {0.9, 0.1, 0.5}, VoxelClass::kUnknown);
  const GainModel gain(world.map.geometry(), world.sensor);
  REQUIRE(explain(world, gain).front().reason == RemainingReason::kOutOfReach);
}

TEST_CASE("a cluster behind closed walls is occluded", "[remaining_reason]") {
  SmallWorld world(Truth::room());
  set_all_free(world);
  set_box(world, {0.6, -0.3, 0.1}, {1.05, 0.3, 0.7}, VoxelClass::kOccupied);
  set_box(world, {0.7, -0.2, 0.2}, {0.95, 0.2, 0.6}, VoxelClass::kUnknown);
  set_box(world, {0.8, -0.05, 0.3}, {0.9, 0.05, 0.5}, VoxelClass::kFree);  // touches free space, as clusters must
  const GainModel gain(world.map.geometry(), world.sensor);
  REQUIRE(explain(world, gain).front().reason == RemainingReason::kOccluded);
}

TEST_CASE("a cluster that the sensor can only be too near to is out of range", "[remaining_reason]") {
  SmallWorld world(Truth::room());
  set_all_free(world);
  set_box(world, {0.7, -0.1, 0.3}, {0.9, 0.1, 0.5}, VoxelClass::kUnknown);
  DepthSensor far_sensor = world.sensor;
  far_sensor.range_min_m = 2.5;
  const GainModel gain(world.map.geometry(), far_sensor);
  REQUIRE(explain(world, gain).front().reason == RemainingReason::kOutOfRange);
}

TEST_CASE("a cluster that was looked at in vain gives no return", "[remaining_reason]") {
  SmallWorld world(Truth::room());
  set_all_free(world);
  // One voxel in front of the camera of the start posture.
  const Eigen::Vector3d p = forward(world.arm, world.q).flange() * world.mount * Eigen::Vector3d(0, 0, 0.7);
  world.map.set(world.map.geometry().index(world.map.geometry().voxel(p)), VoxelClass::kUnknown, 0);
  world.update();
  GainModel gain(world.map.geometry(), world.sensor);
  GainWorker worker = gain.worker();
  REQUIRE(explain(world, gain, 1).front().reason == RemainingReason::kOutOfReach);
  for (int i = 0; i < gain.sampling().futile_max; ++i) gain.remember_look(world.context(), world.q, worker);
  REQUIRE(explain(world, gain, 1).front().reason == RemainingReason::kNoReturn);
}

TEST_CASE("reasons have the words of result.json", "[remaining_reason]") {
  REQUIRE(to_string(RemainingReason::kOccluded) == "occluded");
  REQUIRE(to_string(RemainingReason::kOutOfRange) == "out_of_range");
  REQUIRE(to_string(RemainingReason::kOutOfReach) == "out_of_reach");
  REQUIRE(to_string(RemainingReason::kNoReturn) == "no_return");
}
