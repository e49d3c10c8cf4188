#include <catch2/catch.hpp>

#include "tests/support/ur_robot.hpp"

namespace firstlook {
using namespace sim::ur;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using test::UrRobot;

TEST_CASE("the dashboard greets, answers line by line and says goodbye", "[ur]") {
  UrRobot robot("ur5");
  Session& session = robot.robot.open(Port::kDashboard);
  CHECK(session.output() == "Connected: Universal Robots Dashboard Server\n");
  session.output().clear();
  session.receive("robot");
  CHECK(session.output().empty());
  session.receive("mode\r\nRUNNING\nquit\nrobotmode\n");
  CHECK(session.output() == "Robotmode: RUNNING\nProgram running: false\nDisconnected\n");
  CHECK(session.over());
}

TEST_CASE("the dashboard brings the robot up and down", "[ur]") {
  UrRobot robot("ur5e", false);
  CHECK(robot.dashboard("robotmode") == "Robotmode: POWER_OFF");
  CHECK(robot.dashboard("power on") == "Powering on");
  robot.run(2);
  CHECK(robot.dashboard("robotmode") == "Robotmode: IDLE");
  CHECK(robot.dashboard("brake release") == "Brake releasing");
  robot.run(2);
  CHECK(robot.dashboard("robotmode") == "Robotmode: RUNNING");
  CHECK(robot.dashboard("safetystatus") == "Safetystatus: NORMAL");
  CHECK(robot.dashboard("safetymode") == "Safetymode: NORMAL");
  robot.robot.controller().protective_stop("test");
  CHECK(robot.dashboard("safetystatus") == "Safetystatus: PROTECTIVE_STOP");
  CHECK_THAT(robot.dashboard("unlock protective stop"), StartsWith("Cannot unlock protective stop until 5s"));
  robot.run(5.1);
  CHECK(robot.dashboard("unlock protective stop") == "Protective stop releasing");
  CHECK(robot.dashboard("safetystatus") == "Safetystatus: NORMAL");
  CHECK(robot.dashboard("close safety popup") == "closing safety popup");
  CHECK(robot.dashboard("restart safety") == "Restarting safety");
  CHECK(robot.dashboard("robotmode") == "Robotmode: POWER_OFF");
  CHECK(robot.dashboard("power off") == "Powering off");
}

TEST_CASE("programs are loaded, played, paused and stopped from the dashboard", "[ur]") {
  UrRobot robot("ur5", true, {{"cart.urp", "def cart():\n  while True:\n    sync()\n  end\nend\n", {}}});
  CHECK(robot.dashboard("get loaded program") == "No program loaded");
  CHECK(robot.dashboard("programState") == "STOPPED <unnamed>");
  CHECK(robot.dashboard("play") == "Failed to execute: play");
  CHECK(robot.dashboard("stop") == "Failed to execute: stop");
  CHECK(robot.dashboard("pause") == "Failed to execute: pause");
  CHECK(robot.dashboard("load other.urp") == "File not found: other.urp");
  CHECK(robot.dashboard("load /programs/cart.urp") == "Loading program: /programs/cart.urp");
  CHECK(robot.dashboard("get loaded program") == "Loaded program: /programs/cart.urp");
  CHECK(robot.dashboard("isProgramSaved") == "true cart.urp");
  CHECK(robot.dashboard("play") == "Starting program");
  robot.run(0.1);
  CHECK(robot.dashboard("programState") == "PLAYING cart.urp");
  CHECK(robot.dashboard("running") == "Program running: true");
  CHECK(robot.dashboard("pause") == "Pausing program");
  robot.run(0.1);
  CHECK(robot.dashboard("programState") == "PAUSED cart.urp");
  CHECK(robot.dashboard("play") == "Starting program");
  robot.run(0.1);
  CHECK(robot.dashboard("programState") == "PLAYING cart.urp");
  CHECK(robot.dashboard("stop") == "Stopped");
  robot.run(0.1);
  CHECK(robot.dashboard("programState") == "STOPPED cart.urp");
  CHECK(robot.dashboard("load installation default.installation") == "Loading installation: default.installation");
  CHECK(robot.dashboard("load installation x") == "File not found: x");
}

TEST_CASE("play, pause and stop are answered when it has happened, and what is asked meanwhile waits", "[ur]") {
  UrRobot robot("ur5", true,
                {{"cart.urp",
                  "def cart():\n  while True:\n    speedj([0.5, 0, 0, 0, 0, 0], 1)\n    speedj([-0.5, 0, 0, 0, 0, 0], "
                  "1)\n  end\nend\n",
                  {}}});
  CHECK(robot.dashboard("load cart.urp") == "Loading program: cart.urp");
  Session& session = robot.robot.open(Port::kDashboard);
  session.output().clear();
  const auto ask = [&](const std::string& lines) {
    session.receive(lines);
    CHECK(session.output().empty());
    robot.run(2);
    std::string answers = session.output();
    session.output().clear();
    return answers;
  };
  CHECK(ask("play\nrunning\nprogramState\n") == "Starting program\nProgram running: true\nPLAYING cart.urp\n");
  CHECK(ask("pause\nprogramState\n") == "Pausing program\nPAUSED cart.urp\n");
  CHECK(ask("play\nprogramState\n") == "Starting program\nPLAYING cart.urp\n");
  robot.run(0.3);
  CHECK(ask("stop\nrunning\nprogramState\n") == "Stopped\nProgram running: false\nSTOPPED cart.urp\n");
}

TEST_CASE("a program that cannot be had from another computer fails to play", "[ur]") {
  UrRobot robot("ur5e", true, {{"external.urp", "", {"10.0.0.9", 50002}}});
  CHECK(robot.dashboard("load external.urp") == "Loading program: external.urp");
  CHECK(robot.dashboard("play") == "Failed to execute: play");
}

TEST_CASE("who the robot is", "[ur]") {
  UrRobot cb3("ur10"), e_series("ur10e");
  CHECK(cb3.dashboard("get robot model") == "UR10");
  CHECK_THAT(cb3.dashboard("get serial number"), StartsWith("20"));
  CHECK_THAT(cb3.dashboard("PolyscopeVersion"), StartsWith("URSoftware 3.15.") && Contains(" ("));
  CHECK_THAT(e_series.dashboard("PolyscopeVersion"), StartsWith("URSoftware 5.12."));
  CHECK_THAT(e_series.dashboard("version"), StartsWith("5.12."));
}

TEST_CASE("commands of one generation are unknown to the other", "[ur]") {
  UrRobot cb3("ur5"), e_series("ur5e");
  for (const char* command : {"is in remote control", "get operational mode", "safetystatus", "version",
                              "set operational mode manual", "clear operational mode"}) {
    CHECK(cb3.dashboard(command) == std::string("could not understand: '") + std::string(command) + "'");
    CHECK_THAT(e_series.dashboard(command), !StartsWith("could not understand"));
  }
  CHECK(e_series.dashboard("is in remote control") == "true");
  CHECK(e_series.dashboard("get operational mode") == "NONE");
  CHECK(e_series.dashboard("set operational mode automatic") == "Operational mode automatic is set");
  CHECK(e_series.dashboard("get operational mode") == "AUTOMATIC");
  CHECK(e_series.dashboard("set operational mode x") == "Failed setting operational mode: x");
  CHECK(e_series.dashboard("clear operational mode") ==
        "No longer controlling the operational mode. Current operational mode: 'AUTOMATIC'.");
  CHECK(e_series.dashboard("get operational mode") == "NONE");
  CHECK(cb3.dashboard("setUserRole operator") == "Setting user role: operator");
  CHECK(cb3.dashboard("getUserRole") == "OPERATOR");
  CHECK_THAT(e_series.dashboard("setUserRole operator"), StartsWith("could not understand"));
}

TEST_CASE("pop-ups, log and reports", "[ur]") {
  UrRobot robot("ur5e");
  CHECK(robot.dashboard("popup hello there") == "showing popup");
  CHECK(robot.dashboard("close popup") == "closing popup");
  CHECK(robot.dashboard("addToLog a message") == "Added log message");
  CHECK(robot.dashboard("addToLog") == "No log message to add");
  CHECK(robot.dashboard("saveLog") == "Log saved to disk");
  CHECK(robot.dashboard("generate flight report controller") == "Flight Report generated with id: 1");
  CHECK_THAT(robot.dashboard("generate support file ."), StartsWith("Completed successfully: "));
  CHECK(robot.dashboard("popupx") == "could not understand: 'popupx'");
  CHECK(robot.dashboard("") == "could not understand: ''");
  CHECK(robot.dashboard("shutdown") == "Shutting down");
  CHECK(robot.robot.shutting_down());
}

TEST_CASE("a line without an end does not grow for ever", "[ur]") {
  UrRobot robot("ur5");
  Session& session = robot.robot.open(Port::kDashboard);
  session.receive(std::string(100'000, 'x'));
  CHECK(session.over());
}

}  // namespace firstlook
