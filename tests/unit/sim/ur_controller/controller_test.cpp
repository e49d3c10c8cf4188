#include "hal/sim/ur_controller/controller.hpp"

#include <catch2/catch.hpp>

#include "tests/support/ur_robot.hpp"

namespace firstlook {
using namespace sim::ur;
using test::UrRobot;

TEST_CASE("a controller is powered, released and switched off", "[ur]") {
  UrRobot robot("ur5", false);
  CHECK(robot.state().robot_mode == RobotMode::kPowerOff);
  CHECK(robot.state().timestamp_s > 40);  // clients wait for younger ones to finish booting
  robot.robot.controller().power_on();
  CHECK(robot.state().robot_mode == RobotMode::kPowerOn);
  robot.run(2);
  CHECK(robot.state().robot_mode == RobotMode::kIdle);
  CHECK(robot_status_bits(robot.state()) == 1);
  robot.robot.controller().play();
  CHECK(robot.state().runtime == RuntimeState::kStopped);  // brakes are in
  robot.robot.controller().release_brakes();
  CHECK(robot.state().robot_mode == RobotMode::kIdle);
  robot.run(2);
  CHECK(robot.state().robot_mode == RobotMode::kRunning);
  robot.robot.controller().power_off();
  CHECK(robot.state().robot_mode == RobotMode::kPowerOff);
}

TEST_CASE("releasing brakes switches the power on first", "[ur]") {
  UrRobot robot("ur5e", false);
  robot.robot.controller().release_brakes();
  robot.run(3);
  CHECK(robot.state().robot_mode == RobotMode::kRunning);
}

TEST_CASE("programs play, pause, resume and stop", "[ur]") {
  UrRobot robot("ur5");
  Controller& controller = robot.robot.controller();
  controller.play();
  CHECK(controller.state().runtime == RuntimeState::kPlaying);
  CHECK(robot_status_bits(controller.state()) == 3);
  controller.pause();
  CHECK(controller.state().runtime == RuntimeState::kPausing);
  controller.step();
  CHECK(controller.state().runtime == RuntimeState::kPaused);
  controller.play();
  CHECK(controller.state().runtime == RuntimeState::kResuming);
  controller.step();
  CHECK(controller.state().runtime == RuntimeState::kPlaying);
  controller.stop();
  CHECK(controller.state().runtime == RuntimeState::kStopping);
  controller.step();
  CHECK(controller.state().runtime == RuntimeState::kStopped);
}

TEST_CASE("a protective stop ends program and motion, and can be unlocked after 5 s", "[ur]") {
  UrRobot robot("ur5");
  Controller& controller = robot.robot.controller();
  controller.play();
  JointVector target = controller.motion().position_rad();
  target[0] += 1;
  static_cast<void>(controller.motion().movej(target, 1, 1, 0));
  robot.run(0.5);
  controller.protective_stop("test");
  CHECK(controller.state().safety_mode == SafetyMode::kProtectiveStop);
  CHECK((safety_status_bits(controller.state()) & (1U << 2 | 1U << 10)) == (1U << 2 | 1U << 10));
  CHECK_FALSE(controller.can_play());
  robot.run(1);
  CHECK(controller.state().runtime == RuntimeState::kStopped);
  CHECK(controller.motion().standing());
  CHECK(controller.motion().position_rad()[0] < target[0] - 0.1);
  CHECK_FALSE(controller.unlock_protective_stop());
  robot.run(4.1);
  CHECK(controller.unlock_protective_stop());
  CHECK(controller.state().safety_mode == SafetyMode::kNormal);
  CHECK(controller.can_play());
}

TEST_CASE("an emergency stop takes the power, releasing it does not bring it back", "[ur]") {
  UrRobot robot("ur10e");
  Controller& controller = robot.robot.controller();
  controller.play();
  controller.emergency_stop(true);
  CHECK(controller.state().safety_mode == SafetyMode::kRobotEmergencyStop);
  CHECK(controller.state().robot_mode == RobotMode::kPowerOff);
  controller.power_on();
  robot.run(2);
  CHECK(controller.state().robot_mode == RobotMode::kPowerOff);
  CHECK(controller.state().runtime == RuntimeState::kStopped);
  controller.emergency_stop(false);
  CHECK(controller.state().safety_mode == SafetyMode::kNormal);
  CHECK(controller.state().robot_mode == RobotMode::kPowerOff);
}

TEST_CASE("an arm whose power goes brakes on its path", "[ur]") {
  UrRobot robot("ur5");
  Controller& controller = robot.robot.controller();
  JointVector target = controller.motion().position_rad();
  target[0] += 2;
  controller.play();
  static_cast<void>(controller.motion().movej(target, 1, 2, 0));
  robot.run(1);
  const double at_rad = controller.motion().position_rad()[0];
  controller.emergency_stop(true);
  robot.run(1);
  CHECK(controller.motion().standing());
  CHECK(controller.motion().position_rad()[0] - at_rad == Approx(1 / (2.0 * 6)).margin(0.008));  // v² / 2a, and a cycle
  CHECK(controller.motion().position_rad()[1] == target[1]);
  CHECK(controller.state().runtime == RuntimeState::kStopped);
}

TEST_CASE("a safeguard stop pauses, and what played goes on when it closes", "[ur]") {
  UrRobot robot("ur3");
  Controller& controller = robot.robot.controller();
  controller.play();
  controller.safeguard(true);
  robot.run(0.1);
  CHECK(controller.state().runtime == RuntimeState::kPaused);
  CHECK(controller.state().safety_mode == SafetyMode::kSafeguardStop);
  controller.play();
  CHECK(controller.state().runtime == RuntimeState::kPaused);
  controller.safeguard(false);
  robot.run(0.1);
  CHECK(controller.state().runtime == RuntimeState::kPlaying);

  controller.pause();
  robot.run(0.1);
  controller.safeguard(true);
  controller.safeguard(false);
  robot.run(0.1);
  CHECK(controller.state().runtime == RuntimeState::kPaused);  // a person had paused it
}

TEST_CASE("the reported pose is that of the joints, the speed its derivative", "[ur]") {
  UrRobot robot("ur5e");
  Controller& controller = robot.robot.controller();
  controller.set_tcp_offset({0, 0, 0.1, 0, 0, 0});
  JointVector target = controller.motion().position_rad();
  target[0] += 0.5;
  target[3] -= 0.7;
  static_cast<void>(controller.motion().movej(target, 1, 2, 0));
  robot.run(0.4);
  const ControllerState before = controller.state();
  robot.run(0.002);
  const ControllerState after = controller.state();
  const Pose expected = forward(controller.identity().arm, controller.motion().position_rad()).flange().pose() *
                        Eigen::Translation3d(0, 0, 0.1);
  const Pose reported = pose_of(after.tcp_pose);
  CHECK((reported.translation() - expected.translation()).norm() < 1e-12);
  CHECK((reported.linear() - expected.linear()).norm() < 1e-9);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK((after.tcp_pose[i] - before.tcp_pose[i]) / 0.002 == Approx(after.tcp_speed[i]).margin(2e-3));
    CHECK((after.elbow_position_m[i] - before.elbow_position_m[i]) / 0.002 ==
          Approx(after.elbow_velocity_m_s[i]).margin(2e-3));
  }
  CHECK(std::abs(after.tcp_speed[0]) + std::abs(after.tcp_speed[1]) > 0.05);
}

TEST_CASE("a seed draws a factory correction, the same each time", "[ur]") {
  const auto published = *identify_controller("ur5", 0, "");
  const auto first = *identify_controller("ur5", 7, "");
  const auto again = *identify_controller("ur5", 7, "");
  const auto other = *identify_controller("ur5", 8, "2014350001");
  CHECK(published.arm.dh[1].a_m == published.nominal.dh[1].a_m);
  CHECK(first.arm.dh[1].a_m != first.nominal.dh[1].a_m);
  CHECK(first.arm.dh[1].a_m == Approx(-0.425).margin(2e-3));
  CHECK(first.kinematics_checksums == again.kinematics_checksums);
  CHECK(first.kinematics_checksums != other.kinematics_checksums);
  CHECK(other.serial == "2014350001");
  CHECK(first.serial.starts_with("20"));
  CHECK_FALSE(identify_controller("ur6", 0, ""));
}

TEST_CASE("encoders are as noisy as asked for, the same for everybody in a cycle", "[ur]") {
  UrRobot robot("ur5");
  Controller& controller = robot.robot.controller();
  const Vector6 exact = controller.state().q_rad;
  CHECK(controller.measured_q_rad() == exact);
  CHECK(controller.measured_tcp_pose() == controller.state().tcp_pose);
  constexpr double kSigma_rad = 2e-5;
  controller.set_encoders(kSigma_rad, 3);
  double sum = 0, squared = 0;
  Vector6 before{};
  constexpr int kCycles = 2000;
  for (int i = 0; i < kCycles; ++i) {
    controller.step();
    const Vector6 measured = controller.measured_q_rad();
    REQUIRE(measured == controller.measured_q_rad());
    REQUIRE(measured != before);
    before = measured;
    for (std::size_t j = 0; j < kJoints; ++j) {
      sum += (measured[j] - exact[j]) / kSigma_rad;
      squared += std::pow((measured[j] - exact[j]) / kSigma_rad, 2);
    }
  }
  constexpr double kCount = 6.0 * kCycles;
  CHECK(std::abs(sum / kCount) < 4 / std::sqrt(kCount));
  CHECK(std::abs(squared / kCount - 1) < 4 * std::sqrt(2 / kCount));
  CHECK(controller.measured_tcp_pose() != controller.state().tcp_pose);
  CHECK(controller.state().q_rad == exact);
}

TEST_CASE("a hand leads the arm only where it may move, and the freedrive button is told", "[ur]") {
  UrRobot robot("ur5");
  Controller& controller = robot.robot.controller();
  const JointVector there = controller.motion().position_rad() * 0.9;
  REQUIRE(controller.lead(there, 0.8, 2));
  controller.step();
  CHECK(robot_status_bits(controller.state()) == (1U | 1U << 2));
  robot.run(3);
  CHECK(robot_status_bits(controller.state()) == 1);
  CHECK((controller.motion().position_rad() - there).max_abs() < 1e-12);
  controller.protective_stop("a test");
  CHECK_FALSE(controller.lead(there * 0.9, 0.8, 2));
  UrRobot off("ur5", false);
  CHECK_FALSE(off.robot.controller().lead(there, 0.8, 2));
}

}  // namespace firstlook
