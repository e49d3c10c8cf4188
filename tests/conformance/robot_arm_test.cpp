/// What every RobotArm must do, whoever implements it.
#include <catch2/catch.hpp>

#include "algorithms/kinematics/arm_model.hpp"
#include "hal/sim/simulated_arm.hpp"
#include "tests/support/driven_ur.hpp"
#include "tests/support/mock_robot_arm.hpp"

using namespace firstlook;

namespace {

const JointVector kStart = default_start(*find_arm_model("ur5"));
Instant at(double t_s) { return Instant{seconds(t_s).ns}; }

/// An arm whose operator presses Play at 0.1 s, pauses at 5 s and plays again at 6 s; protective stop at 9 s.
struct Simulated {
  Simulated() : arm(options()) {}
  static sim::SimulatedArmOptions options() {
    sim::SimulatedArmOptions o;
    o.model = *find_arm_model("ur5");
    o.start_rad = kStart;
    o.script.push_back({at(0.1), sim::ControllerAction::kPlay});
    o.script.push_back({at(5), sim::ControllerAction::kPause});
    o.script.push_back({at(6), sim::ControllerAction::kPlay});
    o.script.push_back({at(9), sim::ControllerAction::kProtectiveStop});
    return o;
  }
  sim::SimulatedArm arm;
};

struct Mock {
  Mock() : arm(kStart) {
    arm.at(at(0.1), [](mock::MockRobotArm& a) { a.set_running(true); });
    arm.at(at(5), [](mock::MockRobotArm& a) { a.set_running(false); });
    arm.at(at(6), [](mock::MockRobotArm& a) { a.set_running(true); });
    arm.at(at(9), [](mock::MockRobotArm& a) { a.set_safety(hal::ArmSafety::kProtectiveStop); });
  }
  mock::MockRobotArm arm;
};

/// The driver of a UR arm with a simulated controller behind it; its program takes half a second to be let in.
struct Ur {
  Ur() : arm("ur5") {
    arm.ur.robot.controller().place(kStart);
    arm.at(at(0.1), [](test::DrivenUr& a) { a.play(); });
    arm.at(at(5), [](test::DrivenUr& a) { REQUIRE(a.ur.robot.programs().pause()); });
    arm.at(at(6), [](test::DrivenUr& a) { a.play(); });
    arm.at(at(9), [](test::DrivenUr& a) { a.ur.robot.controller().protective_stop("a test"); });
  }
  test::DrivenUr arm;
};

hal::ArmState latest(hal::RobotArm& arm, Instant now) {
  std::optional<hal::ArmState> last;
  while (const auto state = arm.poll(now)) last = state;
  REQUIRE(last.has_value());
  return *last;
}

hal::Segment segment(std::uint32_t number, double by_rad) {
  hal::Segment s{number, kStart, 1.0, 1.4};
  s.target_rad[0] += by_rad;
  return s;
}

constexpr double kNoise_rad = 5e-4;

}  // namespace

TEMPLATE_TEST_CASE("an arm reports in order, never from the future, and says when the next is due", "[hal][arm]",
                   Simulated, Mock, Ur) {
  TestType device;
  hal::RobotArm& arm = device.arm;
  CHECK(std::string(arm.model()) == "ur5");
  Instant last{-1};
  std::uint64_t count = 0;
  for (double t = 0; t < 1; t += 0.0137) {
    while (const auto state = arm.poll(at(t))) {
      CHECK(state->stamp > last);
      CHECK(state->stamp <= at(t));
      CHECK(state->position_rad.size() == 6);
      CHECK((state->position_rad - kStart).max_abs() < kNoise_rad);
      last = state->stamp;
      ++count;
    }
    CHECK(arm.next_due() > at(t));
    CHECK((arm.next_due() - at(t)).seconds() < 0.05);
  }
  CHECK(count > 50);
  CHECK(arm.counters().states == count);
}

TEMPLATE_TEST_CASE("an arm polled at its due times loses no report", "[hal][arm]", Simulated, Mock, Ur) {
  TestType one, all;
  std::uint64_t polled = 0;
  while (one.arm.next_due() <= at(1)) polled += one.arm.poll(one.arm.next_due()).has_value();
  std::uint64_t at_once = 0;
  while (all.arm.poll(at(1))) ++at_once;
  CHECK(polled == at_once);
}

TEMPLATE_TEST_CASE("an arm executes a segment to its end and reports its number", "[hal][arm]", Simulated, Mock, Ur) {
  TestType device;
  hal::RobotArm& arm = device.arm;
  CHECK(latest(arm, at(1)).segment == 0);
  REQUIRE(arm.move(segment(1, 0.5), at(1)).has_value());
  const hal::ArmState under_way = latest(arm, at(1.2));
  CHECK(under_way.moving);
  CHECK(under_way.segment == 1);
  CHECK(under_way.velocity_rad_s[0] > 0.1);
  const hal::ArmState arrived = latest(arm, at(3));
  CHECK_FALSE(arrived.moving);
  CHECK(arrived.position_rad[0] == Approx(kStart[0] + 0.5).margin(kNoise_rad));
  CHECK(arrived.velocity_rad_s.max_abs() == 0);
  REQUIRE(arm.move(segment(2, 0), at(3)).has_value());
  CHECK(latest(arm, at(3.1)).segment == 2);
  CHECK(arm.counters().segments == 2);
}

TEMPLATE_TEST_CASE("an arm refuses without consent, while it moves, after a protective stop, and nonsense",
                   "[hal][arm]", Simulated, Mock, Ur) {
  TestType device;
  hal::RobotArm& arm = device.arm;
  CHECK_FALSE(latest(arm, at(0.05)).program_running);
  CHECK(arm.move(segment(1, 0.5), at(0.05)).error().fault == Fault::kProgramStopped);
  CHECK(latest(arm, at(1)).program_running);
  hal::Segment nonsense = segment(1, 0.5);
  nonsense.target_rad[2] = std::nan("");
  CHECK_FALSE(arm.move(nonsense, at(1)).has_value());
  nonsense = segment(1, 0.5);
  nonsense.speed_rad_s = -1;
  CHECK_FALSE(arm.move(nonsense, at(1)).has_value());
  REQUIRE(arm.move(segment(1, 0.5), at(1)).has_value());
  CHECK(arm.move(segment(2, 0.1), at(1.1)).error().fault == Fault::kProgramStopped);
  const hal::ArmState stopped = latest(arm, at(9.5));
  CHECK(stopped.safety == hal::ArmSafety::kProtectiveStop);
  CHECK(arm.move(segment(2, 0.1), at(9.5)).error().fault == Fault::kProtectiveStop);
  CHECK(arm.counters().refused == 5);
  CHECK(arm.counters().segments == 1);
}

TEMPLATE_TEST_CASE("stop ends the motion short of the target and withdraws the segment", "[hal][arm]", Simulated, Mock,
                   Ur) {
  TestType device;
  hal::RobotArm& arm = device.arm;
  static_cast<void>(latest(arm, at(1)));
  REQUIRE(arm.move(segment(1, 2), at(1)).has_value());
  arm.stop(at(2));
  const hal::ArmState state = latest(arm, at(2.5));
  CHECK_FALSE(state.moving);
  CHECK(state.program_running);
  CHECK(state.position_rad[0] < kStart[0] + 1.5);
  CHECK(latest(arm, at(4)).position_rad[0] == Approx(state.position_rad[0]).margin(kNoise_rad));
  CHECK(arm.move(segment(2, 0), at(4)).has_value());
  arm.stop(at(8));  // standing still: accepted, too
  CHECK(arm.counters().stops >= 2);
}

TEMPLATE_TEST_CASE("a pause withdraws the segment, resuming waits for a new one", "[hal][arm]", Simulated, Mock, Ur) {
  TestType device;
  hal::RobotArm& arm = device.arm;
  static_cast<void>(latest(arm, at(4.5)));
  REQUIRE(arm.move(segment(1, 2), at(4.5)).has_value());
  const hal::ArmState paused = latest(arm, at(5.9));
  CHECK_FALSE(paused.program_running);
  CHECK_FALSE(paused.moving);
  const hal::ArmState resumed = latest(arm, at(8));
  CHECK(resumed.program_running);
  CHECK_FALSE(resumed.moving);
  CHECK(resumed.position_rad[0] == Approx(paused.position_rad[0]).margin(kNoise_rad));
}
