#include <catch2/catch.hpp>

#include "algorithms/motion/body.hpp"
#include "hal/sim/contacts.hpp"
#include "hal/sim/observable_set.hpp"
#include "tests/support/box_world.hpp"

using namespace firstlook;
using namespace firstlook::sim;
using firstlook::test::BoxWorld;

namespace {

const ArmModel kArm = *find_arm_model("ur5");
const Transform<Flange, Camera> kMount(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, -0.06, 0.05));

ObservableProblem problem_in(const TrueWorld& world, int samples) {
  ObservableProblem p;
  p.arm = &kArm;
  p.world = &world;
  p.geometry = GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, 0.1);
  p.body = body_with_camera(kArm, kMount);
  p.true_capsules = true_capsules(kArm, kArm.joints, kMount.pose());
  p.flange_T_depth = Transform<Flange, Depth>(kMount.pose());
  p.sensor = {640, 480, 589, 609, 319.5, 239.5};  // 57 x 43 degrees
  p.start_rad = default_start(kArm);
  p.options.clearance = {.voxels_m = 0.12, .surface_m = 0.02};
  p.options.samples = samples;
  return p;
}

bool within(const Eigen::Vector3d& p, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  return (p.array() > low.array()).all() && (p.array() < high.array()).all();
}

}  // namespace

TEST_CASE("in a closed room all that is inside can be observed, and nothing outside", "[sim][observable]") {
  BoxWorld world;
  const Eigen::Vector3d low(-1.2, -1.2, -0.2), high(1.2, 1.2, 1.4);  // on voxel boundaries
  world.add_room(low, high);
  const ObservableProblem problem = problem_in(world, 900);
  WorkerPool workers(2);
  const ObservableSet set = observable_set(problem, workers);
  std::size_t inside = 0, inside_seen = 0, beyond_walls_seen = 0;
  for (std::size_t i = 0; i < set.seen.size(); ++i) {
    const Eigen::Vector3d center = problem.geometry.center_m(problem.geometry.voxel_at(i));
    if (set.zone[i] == 0) CHECK(set.seen[i] == 0);
    if (within(center, low, high)) {
      inside += set.zone[i];
      inside_seen += set.seen[i];
    }
    // The walls' own first layer is 0.1 m thick: behind it nothing can be known.
    const Eigen::Vector3d layer = Eigen::Vector3d::Constant(0.1);
    if (!within(center, low - layer, high + layer)) beyond_walls_seen += set.seen[i];
  }
  INFO("reached " << set.configurations_reached << " free " << set.configurations_free << " rounds " << set.rounds
                  << " inside " << inside_seen << " of " << inside);
  CHECK(beyond_walls_seen == 0);
  CHECK(static_cast<double>(inside_seen) > 0.99 * static_cast<double>(inside));
  CHECK(set.configurations_reached > 10);
}

TEST_CASE("what a wall hides cannot be observed", "[sim][observable]") {
  BoxWorld world;
  world.add_room({-1.2, -1.2, -0.2}, {1.2, 1.2, 1.4});
  world.boxes.push_back({{0.6, -1.3, -0.3}, {0.7, 1.3, 1.5}});  // from wall to wall
  const ObservableProblem problem = problem_in(world, 600);
  WorkerPool workers(1);
  const ObservableSet set = observable_set(problem, workers);
  std::size_t behind = 0, behind_in_zone = 0, before = 0, before_in_zone = 0;
  for (std::size_t i = 0; i < set.seen.size(); ++i) {
    const Eigen::Vector3d center = problem.geometry.center_m(problem.geometry.voxel_at(i));
    if (within(center, {0.7, -1.2, -0.2}, {1.2, 1.2, 1.4})) {
      behind += set.seen[i];
      behind_in_zone += set.zone[i];
    }
    if (within(center, {0.0, -1.2, -0.2}, {0.6, 1.2, 1.4})) {
      before += set.seen[i];
      before_in_zone += set.zone[i];
    }
  }
  CHECK(behind_in_zone > 100);
  CHECK(behind == 0);
  CHECK(static_cast<double>(before) > 0.9 * static_cast<double>(before_in_zone));
}

TEST_CASE("the observable set does not depend on the number of workers", "[sim][observable]") {
  BoxWorld world;
  world.add_room({-1.2, -1.2, -0.2}, {1.2, 1.2, 1.4});
  world.boxes.push_back({{0.5, -0.3, -0.2}, {0.9, 0.3, 0.5}});
  const ObservableProblem problem = problem_in(world, 300);
  WorkerPool one(1), two(2);
  const ObservableSet a = observable_set(problem, one), b = observable_set(problem, two);
  CHECK(a.seen == b.seen);
  CHECK(a.configurations_reached == b.configurations_reached);
  CHECK(a.rounds == b.rounds);
}

TEST_CASE("without a return nothing can be observed", "[sim][observable]") {
  const BoxWorld world;  // an open hall
  const ObservableProblem problem = problem_in(world, 200);
  WorkerPool workers(1);
  CHECK(observable_set(problem, workers).voxels == 0);
}
