#include <catch2/catch.hpp>

#include "hal/sim/contacts.hpp"
#include "tests/support/box_world.hpp"

using namespace firstlook;
using namespace firstlook::sim;
using firstlook::test::BoxWorld;

namespace {

const ArmModel kArm = *find_arm_model("ur5");
const Transform<Flange, Camera> kMount(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, -0.06, 0.05));

/// Everything is known free but what the test takes away.
class TestView final : public KnownFreeView {
 public:
  GridGeometry grid = GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, 0.05);
  std::vector<std::uint8_t> free = std::vector<std::uint8_t>(grid.count(), 1);
  [[nodiscard]] const GridGeometry& geometry() const override { return grid; }
  [[nodiscard]] bool free_for_motion(std::size_t voxel) const override { return free[voxel] != 0; }
  bool intact = false;
  [[nodiscard]] bool zone_revoked(std::size_t) const override { return !intact; }
};

ContactMonitor monitor_in(const TrueWorld& world) {
  return {kArm, true_capsules(kArm, kArm.joints, kMount.pose()), base_allowance(kArm), SafeZone{}, world};
}

JointVector turned(double base_rad) {
  JointVector q = default_start(kArm);
  q[0] += base_rad;
  return q;
}

/// The arm reaches out 0.7 m and turns, the camera 0.56 m from one end of the sweep to its middle.
JointVector stretched(double base_rad) { return {base_rad, -0.7, 0.9, -1.8, -1.57, 0}; }

/// Where the camera is for a configuration.
Eigen::Vector3d camera_at(const JointVector& q) { return (forward(kArm, q).flange() * kMount).translation(); }

}  // namespace

TEST_CASE("a body that sweeps through a thin post touches it once each time", "[sim][contacts]") {
  BoxWorld world;
  const Eigen::Vector3d post = camera_at(stretched(0.8));
  world.boxes.push_back({post - Eigen::Vector3d(0.005, 0.005, 0.03), post + Eigen::Vector3d(0.005, 0.005, 0.03)});
  ContactMonitor monitor = monitor_in(world);
  CHECK_FALSE(monitor.body_moved(Instant{}, stretched(0), stretched(0)));
  // In one coarse report from one side to the other: only the steps between find it.
  CHECK_FALSE(monitor.body_moved(Instant{}, stretched(0), stretched(1.6)));
  CHECK(monitor.contacts() == 1);
  CHECK_FALSE(monitor.body_moved(Instant{}, stretched(1.6), stretched(0)));
  CHECK(monitor.contacts() == 2);
  CHECK(monitor.body_moved(Instant{}, stretched(0), stretched(0.8)));
  CHECK(monitor.contacts() == 3);
}

TEST_CASE("no contact in free motion, whatever the arm's own base stands on", "[sim][contacts]") {
  BoxWorld world;
  world.add_room({-1.4, -1.4, -0.02}, {1.4, 1.4, 2});
  ContactMonitor monitor = monitor_in(world);
  JointVector at = turned(-3);
  for (double base = -3; base <= 3; base += 0.05) {
    CHECK_FALSE(monitor.body_moved(Instant{}, at, turned(base)));
    at = turned(base);
  }
  CHECK(monitor.contacts() == 0);
  CHECK(monitor.unknown_entries() == 0);  // inside the safe zone's cylinder all the time
  CHECK(monitor.checks() > 500);
}

TEST_CASE("leaving the safe zone before there is a map is an entry", "[sim][contacts]") {
  const BoxWorld world;
  ContactMonitor monitor = monitor_in(world);
  JointVector out = turned(0);
  out[1] = 0;  // upper arm and forearm stretched out
  out[2] = 0;
  static_cast<void>(monitor.body_moved(Instant{}, turned(0), turned(0)));
  CHECK(monitor.unknown_entries() == 0);
  static_cast<void>(monitor.body_moved(Instant{}, turned(0), out));
  CHECK(monitor.unknown_entries() == 1);
  static_cast<void>(monitor.body_moved(Instant{}, out, turned(0)));
  CHECK(monitor.unknown_entries() == 1);
}

TEST_CASE("each unknown voxel on the way is counted when the body enters it", "[sim][contacts]") {
  const BoxWorld world;
  ContactMonitor monitor = monitor_in(world);
  TestView view;
  monitor.watch(&view);
  static_cast<void>(monitor.body_moved(Instant{}, stretched(0), stretched(0)));
  static_cast<void>(monitor.body_moved(Instant{}, stretched(0), stretched(1.6)));
  CHECK(monitor.unknown_entries() == 0);
  const std::size_t on_the_way = view.grid.index(view.grid.voxel(camera_at(stretched(0.8))));
  view.free[on_the_way] = 0;
  static_cast<void>(monitor.body_moved(Instant{}, stretched(1.6), stretched(0)));
  CHECK(monitor.unknown_entries() == 1);
  static_cast<void>(monitor.body_moved(Instant{}, stretched(0), stretched(0.8)));
  CHECK(monitor.unknown_entries() == 2);
  view.free.assign(view.free.size(), 0);  // standing still is no entry
  static_cast<void>(monitor.body_moved(Instant{}, stretched(0.8), stretched(0.8)));
  CHECK(monitor.unknown_entries() == 2);
  static_cast<void>(monitor.body_moved(Instant{}, stretched(0.8), stretched(0.9)));
  CHECK(monitor.unknown_entries() > 10);
}

TEST_CASE("inside the intact safe zone nothing counts, outside of it the same voxels do", "[sim][contacts]") {
  const BoxWorld world;
  TestView view;
  view.free.assign(view.free.size(), 0);
  const auto entries = [&](bool intact, const JointVector& from, const JointVector& to) {
    view.intact = intact;
    ContactMonitor monitor = monitor_in(world);
    monitor.watch(&view);
    static_cast<void>(monitor.body_moved(Instant{}, from, to));
    return monitor.unknown_entries();
  };
  CHECK(entries(true, turned(-3), turned(3)) == 0);
  CHECK(entries(false, turned(-3), turned(3)) > 100);
  CHECK(entries(true, turned(0), stretched(0)) > 10);
  // A capsule that grows out of the zone within one voxel: the voxel counts from then on.
  view.grid = GridGeometry::covering({-2, -2, -2}, {2, 2, 2}, 4);
  view.free.assign(view.grid.count(), 0);
  CHECK(entries(true, turned(0), turned(1)) == 0);
  const std::uint64_t grown = entries(true, turned(0), stretched(0));
  CHECK(grown >= 1);
  CHECK(grown <= 8);  // all the voxels there are
}

TEST_CASE("where the upper arm begins inside the shoulder, the base allowance excuses both, farther out neither",
          "[sim][contacts]") {
  const BoxWorld world;
  const JointVector from = stretched(0), to = stretched(0.5);
  const Pose upper_arm = forward(kArm, to).base_T_link[2];
  const Capsules body = true_capsules(kArm, kArm.joints, kMount.pose());
  const Capsule& upper = *std::ranges::find_if(body, [](const Capsule& c) { return c.link == 2; });
  // The voxel below a place on the upper arm's axis, by less than its radius.
  const auto entries_below = [&](double part) {
    TestView view;
    const Eigen::Vector3d on_axis = upper_arm * Eigen::Vector3d(upper.a + part * (upper.b - upper.a));
    const Eigen::Vector3d below = on_axis - Eigen::Vector3d(0, 0, upper.radius_m - 0.005);
    view.free[view.grid.index(view.grid.voxel(below))] = 0;
    ContactMonitor monitor = monitor_in(world);
    monitor.watch(&view);
    static_cast<void>(monitor.body_moved(Instant{}, from, to));
    return monitor.unknown_entries();
  };
  CHECK(entries_below(0) == 0);
  CHECK(entries_below(0.05) == 0);  // still inside the housing
  CHECK(entries_below(0.4) > 0);
  CHECK(entries_below(0.8) > 0);
}

TEST_CASE("a voxel counts when the capsule overlaps its box, not when it only touches it", "[sim][contacts]") {
  const GridGeometry grid = GridGeometry::covering({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}, 0.1);
  const auto count = [&](const Capsule& capsule) {
    int voxels = 0;
    walk_capsule(grid, capsule, kOverlapTolerance_m, [&](const Eigen::Vector3i&) { ++voxels; });
    return voxels;
  };
  const Eigen::Vector3d center(0.05, 0.05, 0.05);
  CHECK(count({center, center, 0.05, 1}) == 1);     // fits, touching all six faces
  CHECK(count({center, center, 0.051, 1}) == 7);    // the six neighbours by faces
  CHECK(count({center, center, 0.0708, 1}) == 19);  // and by edges: 0.0707 away
  CHECK(count({center, center, 0.0867, 1}) == 27);  // and by corners: 0.0866 away
  CHECK(count({center, center + Eigen::Vector3d(0.1, 0, 0), 0.04, 1}) == 2);
}

TEST_CASE("distance between segment and box against dense sampling", "[sim][contacts]") {
  Random random(11);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d a = random.normal3(), b = random.normal3();
    const Eigen::Vector3d low(-0.3, -0.2, -0.4), high(0.3, 0.5, 0.1);
    double sampled = 1e9;
    for (int k = 0; k <= 2000; ++k) {
      const Eigen::Vector3d p = a + (b - a) * (k / 2000.0);
      sampled = std::min(sampled, (low - p).cwiseMax(p - high).cwiseMax(0.0).norm());
    }
    const double exact = segment_to_box_m(a, b, low, high);
    CHECK(exact <= sampled + 1e-9);
    CHECK(exact >= sampled - (b - a).norm() / 2000);
  }
}

TEST_CASE("the camera's housing lies inside what the program takes for it", "[sim][contacts]") {
  const Capsule housing = true_housing(kArm.joints, kMount.pose());
  const Body program = body_with_camera(kArm, kMount);
  Random random(5);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p =
        housing.a + (housing.b - housing.a) * random.uniform() + housing.radius_m * random.direction();
    CHECK(std::ranges::any_of(program.capsules, [&](const Capsule& c) {
      return c.link == kArm.joints && segment_distance_m(c.a, c.b, p, p) <= c.radius_m;
    }));
  }
}

TEST_CASE("what a person leads the arm into is not the program's doing, moving off from there is", "[sim][contacts]") {
  BoxWorld world;
  const Eigen::Vector3d post = camera_at(stretched(0.8));
  world.boxes.push_back({post - Eigen::Vector3d(0.005, 0.005, 0.03), post + Eigen::Vector3d(0.005, 0.005, 0.03)});
  TestView view;
  for (std::size_t i = 0; i < view.free.size(); ++i) {
    if ((view.grid.center_m(view.grid.voxel_at(i)) - post).norm() < 0.1) view.free[i] = 0;
  }
  ContactMonitor monitor = monitor_in(world);
  monitor.watch(&view);
  CHECK_FALSE(monitor.body_moved(Instant{}, stretched(0), stretched(0.01)));
  REQUIRE(monitor.unknown_entries() == 0);
  for (int i = 0; i < 10; ++i) monitor.body_led();  // into the post, and there it stays
  CHECK(monitor.contacts() == 0);
  SECTION("brought back") {
    CHECK_FALSE(monitor.body_moved(Instant{}, stretched(0), stretched(0.01)));
    CHECK(monitor.contacts() == 0);
    CHECK(monitor.unknown_entries() == 0);
  }
  SECTION("left there: the first motion of the program's own counts") {
    CHECK(monitor.body_moved(Instant{}, stretched(0.8), stretched(0.801)));
    CHECK(monitor.contacts() == 1);
    CHECK(monitor.unknown_entries() > 0);
  }
}
