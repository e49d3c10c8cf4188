#include <catch2/catch.hpp>
#include <cmath>
#include <utility>
#include <vector>

#include "hal/sim/cell_file.hpp"
#include "hal/sim/contacts.hpp"
#include "hal/sim/simulated_cell.hpp"

using namespace firstlook;
using namespace firstlook::sim;

namespace {

Instant at(double t_s) { return Instant{seconds(t_s).ns}; }

std::unique_ptr<SimulatedCell> cell_with(const std::string& faults, std::uint64_t seed = 1,
                                         const std::string& name = "empty") {
  SimulationOptions options;
  options.cell = name;
  options.seed = seed;
  options.fast_sensor = true;
  options.faults = faults;
  auto cell = make_simulated_cell(options);
  if (!cell) FAIL(describe(cell.error()));
  return std::move(*cell);
}

std::vector<std::uint16_t> depth_at(SimulatedCell& cell, Instant now) {
  const auto frame = cell.depth().poll(now);
  REQUIRE(frame.has_value());
  const CameraIntrinsics& i = cell.depth().intrinsics();
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(i.width * i.height));
  REQUIRE(cell.depth().read(*frame, {pixels.data(), i.width, i.height}).has_value());
  return pixels;
}

Fault fault_of(const SimulationOptions& options) {
  const auto cell = make_simulated_cell(options);
  REQUIRE_FALSE(cell.has_value());
  return cell.error().fault;
}

void turn_base(SimulatedCell& cell, double by_rad, Instant now) {
  while (cell.arm().poll(now)) {
  }
  hal::Segment segment{1, cell.description().start_rad, 0.5, 1.0};
  segment.target_rad[0] += by_rad;
  REQUIRE(cell.arm().move(segment, now).has_value());
}

}  // namespace

TEST_CASE("a cell that cannot be made says why", "[sim][cell]") {
  SimulationOptions options;
  options.cell = "no_such_cell";
  CHECK(fault_of(options) == Fault::kDataMissing);
  options.cell = "empty";
  options.faults = "depth.drpo=1";
  CHECK(fault_of(options) == Fault::kUsage);
}

TEST_CASE("the same seed gives the same bytes, another seed other noise and another mount", "[sim][cell]") {
  const auto a = cell_with("", 3), same = cell_with("", 3), other = cell_with("", 4);
  const std::vector<std::uint16_t> depth = depth_at(*a, at(1));
  CHECK(depth == depth_at(*same, at(1)));
  CHECK(depth != depth_at(*other, at(1)));
  const Pose mount = a->grader().true_flange_T_camera().pose();
  CHECK(mount.isApprox(same->grader().true_flange_T_camera().pose(), 0));
  CHECK_FALSE(mount.isApprox(other->grader().true_flange_T_camera().pose(), 1e-6));
}

TEST_CASE("the cameras hang on the arm: the picture changes with it", "[sim][cell]") {
  const auto moving = cell_with("");
  const auto still = cell_with("");
  turn_base(*moving, 0.8, at(1));
  CHECK(depth_at(*moving, at(5)) != depth_at(*still, at(5)));
  CHECK(moving->grader().contacts() == 0);
  CHECK(moving->grader().unknown_entries() == 0);
}

TEST_CASE("a frame shows the arm at its exposure, however late it is read", "[sim][cell]") {
  const auto prompt = cell_with("");
  const auto late = cell_with("");
  turn_base(*prompt, 0.8, at(1));
  turn_base(*late, 0.8, at(1));
  const std::vector<std::uint16_t> expected = depth_at(*prompt, at(1.8));
  const auto frame = late->depth().poll(at(1.8));
  REQUIRE(frame.has_value());
  while (late->arm().poll(at(2.5))) {
  }
  static_cast<void>(late->depth().poll(at(2.5)));
  const CameraIntrinsics& i = late->depth().intrinsics();
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(i.width * i.height));
  REQUIRE(late->depth().read(*frame, {pixels.data(), i.width, i.height}).has_value());
  CHECK(pixels == expected);
}

TEST_CASE("a frozen camera keeps its picture, a stalled one its frames, a wrong clock its stamps wrong",
          "[sim][cell]") {
  const auto frozen = cell_with("depth.freeze_at=2");
  static_cast<void>(depth_at(*frozen, at(1.99)));
  turn_base(*frozen, 0.8, at(2));
  const std::vector<std::uint16_t> during = depth_at(*frozen, at(3));
  CHECK(during == depth_at(*frozen, at(5)));
  const auto stalled = cell_with("color.stall_at=2");
  CHECK(stalled->color().poll(at(1.9)).has_value());
  static_cast<void>(stalled->color().poll(at(2.1)));
  CHECK_FALSE(stalled->color().poll(at(4)).has_value());
  CHECK(stalled->depth().poll(at(4)).has_value());
  const auto wrong = cell_with("depth.clock=0.25"), right = cell_with("");
  CHECK((wrong->depth().poll(at(1))->stamp - right->depth().poll(at(1))->stamp).seconds() == Approx(0.25));
}

TEST_CASE("an obstacle that appears in the way stops the arm by contact", "[sim][cell]") {
  const ArmModel arm = *find_arm_model("ur5");
  const auto azimuth = [&](const JointVector& q) {
    const Eigen::Vector3d hand = forward(arm, q).flange().translation();
    return std::atan2(hand.y(), hand.x());
  };
  // The arm reaches out 0.7 m and swings through where the box stands, one radian to the left of the start.
  const JointVector reach = {0, -0.7, 0.9, -1.77, -1.57, 0};
  const auto swing = [&](const std::string& faults) {
    auto cell = cell_with(faults);
    const double there = azimuth(cell->description().start_rad) + 1.0 - azimuth(reach);
    hal::ArmState last;
    const auto go = [&](std::uint32_t number, double base_rad, Instant from, Instant until) {
      while (cell->arm().poll(from)) {
      }
      hal::Segment segment{number, reach, 0.5, 1.0};
      segment.target_rad[0] = base_rad;
      REQUIRE(cell->arm().move(segment, from).has_value());
      while (const auto state = cell->arm().poll(until)) last = *state;
    };
    const double begin = std::remainder(there - 1.2, 6.283185307179586);
    go(1, begin, at(1), at(15));
    go(2, begin + 2.4, at(15), at(40));
    CHECK(cell->grader().unknown_entries() > 0);  // outside the safe zone, and there was no map
    return std::pair(last, std::move(cell));
  };
  const auto [free, free_cell] = swing("");
  CHECK(free.safety == hal::ArmSafety::kNormal);
  CHECK(free_cell->grader().contacts() == 0);
  const auto [stopped, cell] = swing("obstacle.appear_at=10");
  CHECK(stopped.safety == hal::ArmSafety::kProtectiveStop);
  CHECK_FALSE(stopped.program_running);
  CHECK_FALSE(stopped.moving);
  CHECK(cell->grader().contacts() == 1);
}

TEST_CASE("a camera beside the arm sees the same, wherever the arm is, without a board nothing is found",
          "[sim][cell]") {
  const auto fixed = cell_with("camera.fixed=1");
  const auto before = fixed->color().poll(at(1));
  REQUIRE(before.has_value());
  const auto corners = fixed->color().read_corners(*before, 0);
  REQUIRE(corners.has_value());
  REQUIRE_FALSE(corners->corners_px.empty());
  turn_base(*fixed, 1.5, at(1));
  const auto after = fixed->color().poll(at(6));
  REQUIRE(after.has_value());
  const auto again = fixed->color().read_corners(*after, 0);
  REQUIRE(again.has_value());
  REQUIRE(again->corners_px.size() == corners->corners_px.size());
  for (std::size_t i = 0; i < again->corners_px.size(); ++i) {
    CHECK(again->corners_px[i][0] == Approx(corners->corners_px[i][0]).margin(1.5));
    CHECK(again->corners_px[i][1] == Approx(corners->corners_px[i][1]).margin(1.5));
  }
  const auto absent = cell_with("camera.fixed=1,board.absent=1");
  const auto frame = absent->color().poll(at(1));
  REQUIRE(frame.has_value());
  CHECK(absent->color().read_corners(*frame, 0)->corners_px.empty());
}

TEST_CASE("the true camera stays inside the envelope that is assumed before calibration", "[sim][cell]") {
  for (const char* name : {"empty", "workshop", "machine_tending", "cluttered", "hall"}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const auto scene = load_cell(name, seed);
      REQUIRE(scene.has_value());
      const Capsule housing = true_housing(scene->mount.link, scene->mount.link_T_camera);
      CHECK(std::max(housing.a.norm(), housing.b.norm()) + housing.radius_m <= 0.20);  // DESIGN rule 3
    }
  }
}
