#include "hal/sim/ur_controller/happenings.hpp"

#include <sstream>

#include "tests/support/ur_robot.hpp"

namespace firstlook {
using namespace sim::ur;
using Catch::Matchers::Contains;
using test::UrRobot;

namespace {
void happens(UrRobot& robot, std::string_view words) {
  const auto happening = read_happening(words);
  REQUIRE(happening);
  happen(*happening, robot.robot);
}
}  // namespace

TEST_CASE("what can happen is told in words, and read from them", "[ur]") {
  std::istringstream lines(happenings_in_words());
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    std::string word = line.substr(2, line.find(' ', 2) - 2);
    if (const std::size_t equals = word.find("=NUMBER"); equals != std::string::npos) word.replace(equals, 7, "=0.5");
    if (const std::size_t equals = word.find("=TEXT"); equals != std::string::npos) word.replace(equals, 5, "=a=b");
    INFO(word);
    CHECK(read_happening(word));
    CHECK(read_timed_happening("2.5=" + word)->stamp == Instant{2'500'000'000});
  }
  CHECK(count > 15);
  for (const char* wrong : {"", "estop", "slider", "slider=2", "slider=x", "stop=1", "clock=nan", "answer"}) {
    const auto read = read_happening(wrong);
    REQUIRE_FALSE(read);
    CHECK(read.error().fault == Fault::kUsage);
  }
  for (const char* wrong : {"stop", "=stop", "-1=stop", "x=stop", "5=nothing", "5"})
    CHECK_FALSE(read_timed_happening(wrong));
}

TEST_CASE("after an emergency stop: the button, power, brakes", "[ur]") {
  const bool system = GENERATE(false, true);
  UrRobot robot("ur5e");
  happens(robot, system ? "system-emergency-stop" : "emergency-stop");
  CHECK(robot.dashboard("safetymode") ==
        std::string("Safetymode: ") + (system ? "SYSTEM_EMERGENCY_STOP" : "ROBOT_EMERGENCY_STOP"));
  CHECK(robot.dashboard("robotmode") == "Robotmode: POWER_OFF");
  robot.dashboard("power on");
  robot.run(2);
  CHECK(robot.dashboard("robotmode") == "Robotmode: POWER_OFF");
  CHECK(robot.dashboard("restart safety") == "Restarting safety");
  CHECK_THAT(robot.dashboard("safetymode"), Contains("EMERGENCY_STOP"));  // its button is still pressed
  happens(robot, "release-emergency-stop");
  CHECK(robot.dashboard("safetymode") == "Safetymode: NORMAL");
  CHECK(robot.dashboard("close safety popup") == "closing safety popup");
  CHECK(robot.dashboard("power on") == "Powering on");
  robot.run(2);
  CHECK(robot.dashboard("robotmode") == "Robotmode: IDLE");
  CHECK(robot.dashboard("brake release") == "Brake releasing");
  robot.run(2);
  CHECK(robot.dashboard("robotmode") == "Robotmode: RUNNING");
}

TEST_CASE("after a violation or a fault the safety system is restarted", "[ur]") {
  const bool fault = GENERATE(false, true);
  UrRobot robot("ur5");
  happens(robot, fault ? "safety-fault" : "safety-violation");
  CHECK(robot.dashboard("safetymode") == std::string("Safetymode: ") + (fault ? "FAULT" : "VIOLATION"));
  robot.dashboard("brake release");
  robot.run(3);
  CHECK(robot.dashboard("robotmode") == "Robotmode: POWER_OFF");
  CHECK(robot.dashboard("unlock protective stop") == "Protective stop releasing");
  CHECK(robot.dashboard("safetymode") == std::string("Safetymode: ") + (fault ? "FAULT" : "VIOLATION"));
  robot.dashboard("restart safety");
  CHECK(robot.dashboard("safetymode") == "Safetymode: NORMAL");
  robot.dashboard("brake release");
  robot.run(3);
  CHECK(robot.dashboard("robotmode") == "Robotmode: RUNNING");
}

TEST_CASE("a protective stop that pauses the program lets it go on after unlock and Play", "[ur]") {
  UrRobot robot("ur5", true, {{"turn.urp", "def turn():\n  movej([0, -1.5, -1, -1, 1, 0], a=1, v=1)\nend\n", {}}});
  robot.dashboard("load turn.urp");
  robot.dashboard("play");
  robot.run(0.5);
  happens(robot, "protective-stop-paused");
  robot.run(1);
  CHECK(robot.dashboard("programState") == "PAUSED turn.urp");
  CHECK(robot.dashboard("play") == "Failed to execute: play");
  const double at_rad = robot.state().q_rad[0];
  CHECK_THAT(robot.dashboard("unlock protective stop"), Contains("Cannot unlock"));
  robot.run(5);
  CHECK(robot.state().q_rad[0] == at_rad);
  CHECK(robot.dashboard("unlock protective stop") == "Protective stop releasing");
  robot.run(1);
  CHECK(robot.state().q_rad[0] == at_rad);
  CHECK(robot.dashboard("play") == "Starting program");
  robot.run(5);
  CHECK(std::abs(robot.state().q_rad[0]) < 1e-9);
}

TEST_CASE("Play on the pendant goes on with a paused program, whoever sent it", "[ur]") {
  UrRobot robot("ur5");
  robot.robot.open(Port::kSecondary).receive("def sent():\n  while True:\n    sync()\n  end\nend\n");
  robot.run(0.5);
  happens(robot, "pause");
  robot.run(0.5);
  REQUIRE(robot.state().runtime == RuntimeState::kPaused);
  happens(robot, "play");
  robot.run(0.5);
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
}

TEST_CASE("in recovery nothing plays", "[ur]") {
  UrRobot robot("ur5e");
  happens(robot, "recovery-mode");
  CHECK(robot.dashboard("safetymode") == "Safetymode: RECOVERY");
  CHECK_FALSE(robot.robot.controller().can_play());
  happens(robot, "normal-mode");
  CHECK(robot.robot.controller().can_play());
  happens(robot, "reduced-mode");
  CHECK(robot.robot.controller().can_play());
}

TEST_CASE("a reboot ends all connections, and the clock begins anew", "[ur]") {
  UrRobot robot("ur5e");
  robot.robot.controller().set_tcp_offset({0, 0, 0.1, 0, 0, 0});
  Session& rtde = robot.robot.open(Port::kRtde);
  Session& truth = robot.robot.open(Port::kTruth);
  const double simulated_s = robot.robot.controller().simulated_s();
  happens(robot, "reboot");
  CHECK(rtde.over());
  CHECK_FALSE(truth.over());
  CHECK_FALSE(robot.robot.serves(Port::kDashboard));
  CHECK(robot.robot.serves(Port::kHappenings));
  robot.run(1);
  CHECK(robot.state().robot_mode == RobotMode::kBooting);
  CHECK(robot.state().timestamp_s == Approx(1));
  CHECK(robot.robot.controller().simulated_s() == Approx(simulated_s + 1));
  robot.robot.controller().power_on();
  robot.run(11);
  CHECK(robot.state().robot_mode == RobotMode::kPowerOff);
  CHECK(robot.robot.serves(Port::kDashboard));
  CHECK(robot.state().tcp_offset[2] == 0);
}

TEST_CASE("the private port takes lines and answers each", "[ur]") {
  UrRobot robot("ur5");
  Session& session = robot.robot.open(Port::kHappenings);
  CHECK_THAT(session.output(), Contains("help"));
  session.output().clear();
  session.receive("slider=0.25\r\nemerg");
  session.receive("ency-stop\nnonsense\nhelp\n");
  CHECK_THAT(session.output(),
             Catch::Matchers::StartsWith("done\ndone\n'nonsense' is nothing") && Contains("release-emergency-stop"));
  CHECK(robot.state().speed_slider == 0.25);
  CHECK(robot.state().safety_mode == SafetyMode::kRobotEmergencyStop);
  session.receive(std::string(10'000, 'x'));
  CHECK(session.over());
}

}  // namespace firstlook
