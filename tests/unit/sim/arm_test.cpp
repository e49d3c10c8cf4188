#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "hal/sim/simulated_arm.hpp"

using namespace firstlook;
using namespace firstlook::sim;

namespace {

constexpr double kSpeed_rad_s = 1.0;
constexpr double kAcceleration_rad_s2 = 1.4;

SimulatedArmOptions options_with(std::initializer_list<ControllerEvent> script) {
  SimulatedArmOptions options;
  options.model = *find_arm_model("ur5");
  options.start_rad = default_start(options.model);
  for (const ControllerEvent& event : script) options.script.push_back(event);
  return options;
}
SimulatedArmOptions playing() { return options_with({{Instant{}, ControllerAction::kPlay}}); }

JointVector moved(JointVector q, int joint, double by_rad) {
  q[joint] += by_rad;
  return q;
}
hal::Segment to(const JointVector& target) { return {1, target, kSpeed_rad_s, kAcceleration_rad_s2}; }
Instant at(double t_s) { return Instant{seconds(t_s).ns}; }

hal::ArmState latest(SimulatedArm& arm, Instant now) {
  std::optional<hal::ArmState> last;
  while (const auto state = arm.poll(now)) last = state;
  REQUIRE(last.has_value());
  return *last;
}

}  // namespace

TEST_CASE("movej takes the time of its trapezoid and passes its points", "[sim][arm]") {
  SimulatedArm arm(playing());
  const JointVector start = default_start(*find_arm_model("ur5"));
  const double way_rad = 1.2;
  arm.advance(at(1));
  REQUIRE(arm.move(to(moved(start, 0, way_rad)), at(1)).has_value());
  // v / a each for the ramps, and what they leave of the way at full speed.
  const double ramp_s = kSpeed_rad_s / kAcceleration_rad_s2;
  const double duration_s = way_rad / kSpeed_rad_s + ramp_s;
  CHECK(latest(arm, at(1 + duration_s - 0.009)).moving);
  CHECK_FALSE(latest(arm, at(1 + duration_s + 0.009)).moving);
  CHECK(arm.true_joints(at(1 + ramp_s))[0] - start[0] ==
        Approx(0.5 * kSpeed_rad_s * kSpeed_rad_s / kAcceleration_rad_s2));
  CHECK(arm.true_joints(at(1 + duration_s / 2))[0] - start[0] == Approx(way_rad / 2));
}

TEST_CASE("a short movej is a triangle and all joints end together", "[sim][arm]") {
  SimulatedArm arm(playing());
  const JointVector start = default_start(*find_arm_model("ur5"));
  const double way_rad = 0.2;
  arm.advance(at(1));
  REQUIRE(arm.move(to(moved(moved(start, 0, way_rad), 4, -0.1)), at(1)).has_value());
  const double duration_s = 2 * std::sqrt(way_rad / kAcceleration_rad_s2);
  arm.advance(at(3));
  const JointVector half = arm.true_joints(at(1 + duration_s / 2));
  CHECK(half[0] - start[0] == Approx(way_rad / 2));
  CHECK(half[4] - start[4] == Approx(-0.05));
  CHECK(latest(arm, at(1 + duration_s + 0.009)).segment == 1);
}

TEST_CASE("the controller refuses what it cannot do", "[sim][arm]") {
  SimulatedArm arm(playing());
  const JointVector start = default_start(*find_arm_model("ur5"));
  arm.advance(at(1));
  const auto fault_of = [&](const hal::Segment& segment) {
    const Status status = arm.move(segment, at(1));
    REQUIRE_FALSE(status.has_value());
    return status.error().fault;
  };
  hal::Segment segment = to(start);
  segment.target_rad[1] = 7;
  CHECK(fault_of(segment) == Fault::kMoveRefused);
  segment.target_rad[1] = std::nan("");
  CHECK(fault_of(segment) == Fault::kMoveRefused);
  segment = to(moved(start, 0, 1));
  segment.speed_rad_s = 3.3;  // 180 deg/s is 3.14
  CHECK(fault_of(segment) == Fault::kMoveRefused);
  segment.speed_rad_s = 0;
  CHECK(fault_of(segment) == Fault::kMoveRefused);
  segment.speed_rad_s = 1;
  segment.acceleration_rad_s2 = 1000;
  CHECK(fault_of(segment) == Fault::kMoveRefused);
  CHECK(arm.counters().refused == 5);
  CHECK(arm.true_joints(at(1)) == start);
}

TEST_CASE("nothing moves without the operator's program", "[sim][arm]") {
  const JointVector start = default_start(*find_arm_model("ur5"));
  SECTION("before Play") {
    SimulatedArm arm(options_with({{at(2), ControllerAction::kPlay}}));
    arm.advance(at(1));
    const Status status = arm.move(to(moved(start, 0, 1)), at(1));
    REQUIRE_FALSE(status.has_value());
    CHECK(status.error().fault == Fault::kProgramStopped);
    CHECK_FALSE(latest(arm, at(1.5)).program_running);
    CHECK(latest(arm, at(2.5)).program_running);
    CHECK(arm.true_joints(at(2.5)) == start);
  }
  SECTION("a pause withdraws the segment, and resuming does not bring it back") {
    SimulatedArm arm(options_with(
        {{Instant{}, ControllerAction::kPlay}, {at(1.5), ControllerAction::kPause}, {at(3), ControllerAction::kPlay}}));
    arm.advance(at(1));
    REQUIRE(arm.move(to(moved(start, 0, 1)), at(1)).has_value());
    const hal::ArmState paused = latest(arm, at(2.9));
    CHECK_FALSE(paused.program_running);
    CHECK_FALSE(paused.moving);
    CHECK(paused.position_rad[0] - start[0] < 0.5);
    const hal::ArmState resumed = latest(arm, at(6));
    CHECK(resumed.program_running);
    CHECK(resumed.position_rad[0] == Approx(paused.position_rad[0]).margin(2e-4));
    CHECK(arm.move(to(start), at(6)).has_value());
  }
  SECTION("a protective stop stays, whatever is pressed") {
    SimulatedArm arm(options_with({{Instant{}, ControllerAction::kPlay},
                                   {at(1.5), ControllerAction::kProtectiveStop},
                                   {at(2), ControllerAction::kPlay}}));
    arm.advance(at(1));
    REQUIRE(arm.move(to(moved(start, 0, 1)), at(1)).has_value());
    const hal::ArmState state = latest(arm, at(3));
    CHECK(state.safety == hal::ArmSafety::kProtectiveStop);
    CHECK_FALSE(state.program_running);
    CHECK_FALSE(state.moving);
    CHECK(arm.move(to(start), at(3)).error().fault == Fault::kProtectiveStop);
  }
  SECTION("a lost link ends reports and, by the dead man's switch, the motion") {
    SimulatedArm arm(options_with({{Instant{}, ControllerAction::kPlay}, {at(1.5), ControllerAction::kLinkLost}}));
    arm.advance(at(1));
    REQUIRE(arm.move(to(moved(start, 0, 2)), at(1)).has_value());
    CHECK(latest(arm, at(1.49)).moving);
    CHECK(arm.move(to(start), at(1.6)).error().fault == Fault::kLinkLost);
    arm.advance(at(4));
    while (const auto state = arm.poll(at(4))) CHECK(state->stamp < at(1.5));
    CHECK(arm.true_joints(at(4))[0] - start[0] < 1);
    CHECK(arm.next_due() == kNeverDue);
  }
}

TEST_CASE("stop brakes on the path within the controller's deceleration", "[sim][arm]") {
  SimulatedArm arm(playing());
  const JointVector start = default_start(*find_arm_model("ur5"));
  const JointVector target = moved(moved(start, 0, 2), 4, 1);
  arm.advance(at(1));
  REQUIRE(arm.move(to(target), at(1)).has_value());
  const Instant when = at(2.0);  // at full speed
  arm.stop(when);
  arm.advance(at(4));
  const double braked_rad = arm.true_joints(at(4))[0] - arm.true_joints(when)[0];
  CHECK(braked_rad == Approx(kSpeed_rad_s * kSpeed_rad_s / (2 * 12)).epsilon(1e-6));  // 12 rad/s2: the base's
  for (double t = 2.0; t < 4; t += 0.01) {
    const JointVector way = arm.true_joints(at(t)) - start;
    CHECK(way[4] == Approx(way[0] / 2).margin(1e-12));  // on the path
  }
  CHECK(arm.counters().stops == 1);
  CHECK_FALSE(latest(arm, at(4)).moving);
}

TEST_CASE("the flange swings after a stop and is still within 0.4 s", "[sim][arm]") {
  const ArmModel model = *find_arm_model("ur5");
  SimulatedArm arm(playing());
  const JointVector start = default_start(model);
  arm.advance(at(1));
  REQUIRE(arm.move(to(moved(start, 0, 1)), at(1)).has_value());
  const double end_s = 1 + 1 / kSpeed_rad_s + kSpeed_rad_s / kAcceleration_rad_s2;
  arm.advance(at(5));
  const auto offset_m = [&](double t) {
    const Eigen::Vector3d there = forward(model, arm.true_joints(at(t))).flange().translation();
    return (there - forward(model, moved(start, 0, 1)).flange().translation()).norm();
  };
  double largest = 0;
  for (double t = end_s + 0.001; t < end_s + 0.4; t += 0.002) largest = std::max(largest, offset_m(t));
  CHECK(largest > 1e-4);
  for (double t = end_s + 0.4; t < end_s + 3; t += 0.002) CHECK(offset_m(t) < 1e-4);
}

TEST_CASE("the true flange deviates by the stated sigmas, the same at the same configuration", "[sim][arm]") {
  const ArmModel model = *find_arm_model("ur5");
  const SimulatedArm arm(playing());
  const SimulatedArm same(playing());
  Random random(3);
  double squares_m = 0, squares_rad = 0;
  const int n = 2000;
  for (int i = 0; i < n; ++i) {
    JointVector q = JointVector::zero(6);
    for (int j = 0; j < 6; ++j) q[j] = random.uniform(-3, 3);
    const Pose deviation = forward(model, q).flange().pose().inverse() * arm.true_flange(q).pose();
    squares_m += deviation.translation().squaredNorm() / 3;
    squares_rad += std::pow(Eigen::AngleAxisd(deviation.linear()).angle(), 2) / 3;
    CHECK(arm.true_flange(q).pose().isApprox(same.true_flange(q).pose(), 0));
  }
  CHECK(std::sqrt(squares_m / n) == Approx(1e-4).epsilon(0.2));
  CHECK(std::sqrt(squares_rad / n) == Approx(2e-4).epsilon(0.2));
}

TEST_CASE("reports come at 125 Hz, in order, with encoder noise, the same seed gives the same", "[sim][arm]") {
  SimulatedArm a(playing()), b(playing());
  std::vector<hal::ArmState> reports;
  while (const auto state = a.poll(at(1))) reports.push_back(*state);
  REQUIRE(reports.size() == 125);
  const JointVector start = default_start(*find_arm_model("ur5"));
  for (std::size_t i = 0; i < reports.size(); ++i) {
    CHECK(reports[i].stamp.ns == static_cast<std::int64_t>(i + 1) * 8'000'000);
    CHECK((reports[i].position_rad - start).max_abs() < 2e-4);
    Instant now = reports[i].stamp;
    const auto other = b.poll(now);  // polled one by one instead of at once
    REQUIRE(other.has_value());
    CHECK(other->position_rad == reports[i].position_rad);
  }
  CHECK(reports[0].position_rad[0] != reports[1].position_rad[0]);
}
