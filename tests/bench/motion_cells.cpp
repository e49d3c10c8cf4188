#include "tests/bench/motion_cells.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <numbers>

#include "algorithms/motion/certificate.hpp"
#include "algorithms/motion/clearance.hpp"
#include "hal/sim/random_cell.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook::bench {
namespace {

constexpr double kFieldMax_m = 0.6;       // as the job's
constexpr double kTargetMargin_m = 5e-3;  // as exploration asks of its targets

sim::Scene scene_of(std::uint64_t seed) {
  auto scene = sim::make_random_cell(seed, seed);
  if (scene) return std::move(*scene);
  fmt::print(stderr, "firstlook_bench: {}\n", describe(scene.error()));
  std::exit(3);
}

}  // namespace

MotionCell::MotionCell(std::uint64_t seed, double resolution_m)
    : geometry(GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, resolution_m)),
      field(geometry, kFieldMax_m),
      arm(*find_arm_model("ur5")) {
  const sim::Scene scene = scene_of(seed);
  free = sim::occupied_voxels(scene, geometry);
  for (std::uint8_t& voxel : free) voxel = voxel == 0 ? 1 : 0;
  field.update(free);
  body = body_with_camera(arm, scene.mount.flange_T_camera());
  clearance = required_clearance({.voxel_m = resolution_m}).clearance();
  space.field = &field;
  space.zone_intact = false;
}

bool MotionCell::is_free(const JointVector& q_rad) const {
  return configuration_is_free(arm, body, space, clearance, q_rad);
}

JointVector MotionCell::random_joints(Random& random) const {
  JointVector q = JointVector::zero(arm.joints);
  for (int j = 0; j < arm.joints; ++j) q[j] = random.uniform(-std::numbers::pi, std::numbers::pi);
  return q;
}

JointVector MotionCell::random_free_joints(Random& random) const {
  for (int attempt = 0; attempt < 100000; ++attempt) {
    const JointVector q = random_joints(random);
    if (configuration_is_free(arm, body, space, clearance, q, kTargetMargin_m)) return q;
  }
  ENSURE(9201, false);
  return {};
}

std::vector<std::unique_ptr<MotionCell>> motion_cells(int count, double resolution_m) {
  std::vector<std::unique_ptr<MotionCell>> cells;
  for (int i = 1; i <= count; ++i) {
    cells.push_back(std::make_unique<MotionCell>(static_cast<std::uint64_t>(i), resolution_m));
  }
  return cells;
}

}  // namespace firstlook::bench
