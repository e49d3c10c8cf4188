/// What a program shows on the pendant, and who takes it away.
#include <catch2/catch.hpp>

#include "hal/sim/ur_controller/happenings.hpp"
#include "tests/support/script_robot.hpp"

namespace firstlook {
using namespace sim::ur;
using namespace test;
using Catch::Matchers::StartsWith;

namespace {

const std::string kAsks =
    "def prog():\n  global count = 0\n  thread counter():\n    while True:\n      count = count + 1\n      sync()\n"
    "    end\n  end\n  run counter()\n  sleep(0.1)\n  before = count\n  popup(\"look\", \"Title\", blocking=True)\n"
    "  textmsg(count - before < 5)\nend\n";

/// Messages of type 20 of this kind on the primary interface, without time and source.
std::vector<std::string> messages(Session& primary, int kind) {
  std::vector<std::string> found;
  for (const UrPacket& packet : take_packets(primary.output())) {
    if (packet.type == 20 && packet.content[9] == kind) found.push_back(packet.content.substr(10));
  }
  return found;
}

}  // namespace

TEST_CASE("a blocking popup suspends the program until it is closed", "[ur][script]") {
  ScriptRobot robot;
  robot.send(kAsks, 1);
  CHECK(robot.texts.empty());
  CHECK(robot.state().runtime == RuntimeState::kPaused);
  CHECK_THAT(robot.dashboard("programState"), StartsWith("PAUSED"));
  CHECK(robot.dashboard("running") == "Program running: true");
  CHECK(robot.dashboard("close popup") == "closing popup");
  robot.listen(0.1);
  CHECK(robot.texts == std::vector<std::string>{"True"});  // no thread went on meanwhile
  CHECK(robot.state().runtime == RuntimeState::kStopped);
  CHECK(robot.exceptions.empty());
}

TEST_CASE("Play alone does not get past a popup, Stop ends it with its program", "[ur][script]") {
  ScriptRobot robot;
  robot.send(kAsks, 1);
  robot.dashboard("play");
  robot.listen(0.5);
  CHECK(robot.texts.empty());
  CHECK(robot.state().runtime == RuntimeState::kPaused);
  CHECK(robot.dashboard("stop") == "Stopped");
  CHECK(robot.dashboard("close popup") == "closing popup");  // there is none any more
  robot.listen(0.1);
  CHECK(robot.texts.empty());
  CHECK(robot.state().runtime == RuntimeState::kStopped);
  // The next program is not held by it.
  robot.send("def next():\n  sleep(0.2)\n  textmsg(\"next\")\nend\n");
  CHECK(robot.texts == std::vector<std::string>{"next"});
}

TEST_CASE("a closed popup does not start a robot that may not move", "[ur][script]") {
  ScriptRobot robot;
  robot.send(kAsks, 1);
  robot.robot.controller().protective_stop("a test", Controller::Program::kPauses);
  CHECK(robot.dashboard("close popup") == "closing popup");
  robot.listen(6);
  CHECK(robot.texts.empty());
  CHECK(robot.state().runtime == RuntimeState::kPaused);
  CHECK_THAT(robot.dashboard("unlock protective stop"), StartsWith("Protective stop releasing"));
  robot.dashboard("play");
  robot.listen(0.1);
  CHECK(robot.texts == std::vector<std::string>{"True"});
}

TEST_CASE("other popups do not wait", "[ur][script]") {
  ScriptRobot robot;
  robot.send("def prog():\n  popup(\"look\")\n  textmsg(\"went on\")\n  sleep(1)\nend\n", 0.1);
  robot.send("sec beside():\n  popup(\"look\", blocking=True)\n  textmsg(\"beside\")\nend\n", 0.1);
  CHECK(robot.texts == std::vector<std::string>{"went on", "beside"});
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
}

TEST_CASE("who presses Play at the pendant closes the popup first", "[ur]") {
  ScriptRobot robot;
  robot.send(kAsks, 1);
  happen(*read_happening("play"), robot.robot);
  robot.listen(0.1);
  CHECK(robot.texts == std::vector<std::string>{"True"});
}

TEST_CASE("a program asks the operator for values and waits for them", "[ur][script]") {
  ScriptRobot robot;
  robot.send(
      "def prog():\n  a = request_boolean_from_primary_client(\"Go?\")\n  textmsg(a)\n"
      "  b = request_integer_from_primary_client(\"How many?\")\n  textmsg(b + 1)\n"
      "  c = request_float_from_primary_client(\"How far?\")\n  textmsg(c * 2)\n"
      "  d = request_string_from_primary_client(\"Who?\")\n  textmsg(d)\nend\n");
  CHECK(robot.texts.empty());
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
  // What is not of the type asked for is not taken.
  for (const char* entered : {"yes", "True", "2.5", "4", "far", "nan", "2.5", "a=b c"}) {
    happen(*read_happening(std::string("answer=") + entered), robot.robot);
    robot.listen(0.02);
  }
  CHECK(robot.texts == std::vector<std::string>{"True", "5", "5", "a=b c"});
  CHECK(robot.exceptions.empty());
  CHECK(robot.state().runtime == RuntimeState::kStopped);
}

TEST_CASE("dialogs of several threads are filled in one after the other", "[ur][script]") {
  ScriptRobot robot;
  robot.send(
      "def prog():\n  thread other():\n    textmsg(\"other \", request_integer_from_primary_client(\"other\"))\n  end\n"
      "  t = run other()\n  textmsg(\"main \", request_integer_from_primary_client(\"main\"))\n  join t\nend\n",
      0.1);
  CHECK_FALSE(happen(*read_happening("answer=one"), robot.robot));
  CHECK(happen(*read_happening("answer=1"), robot.robot));
  CHECK(happen(*read_happening("answer=2"), robot.robot));
  CHECK_FALSE(happen(*read_happening("answer=3"), robot.robot));
  robot.listen(0.1);
  CHECK(robot.texts == std::vector<std::string>{"main 1", "other 2"});
}

TEST_CASE("a dialog ends with its program", "[ur][script]") {
  ScriptRobot robot;
  robot.send("textmsg(request_integer_from_primary_client(\"How many?\"))\n", 0.1);
  CHECK(robot.dashboard("stop") == "Stopped");
  robot.send("textmsg(request_string_from_primary_client(\"Who?\"))\n", 0.1);
  happen(*read_happening("answer=somebody"), robot.robot);
  robot.listen(0.1);
  CHECK(robot.texts == std::vector<std::string>{"somebody"});
  robot.send("request_string_from_primary_client(\"\")\n", 0.1);
  CHECK(robot.exceptions.size() == 1);
}

TEST_CASE("requests are told on the primary interface with the fields of UR's tables", "[ur]") {
  UrRobot robot("ur5e");
  Session& primary = robot.robot.open(Port::kPrimary);
  primary.receive("request_float_from_primary_client(\"How far?\")\n");
  robot.run(0.1);
  auto requests = messages(primary, 9);
  REQUIRE(requests.size() == 1);
  CHECK(requests[0] == big_endian(1, 4) + big_endian(2, 4) + "How far?");
  primary.receive("request_boolean_from_primary_client(\"Go?\")\n");
  robot.run(0.1);
  requests = messages(primary, 9);
  REQUIRE(requests.size() == 1);
  CHECK(requests[0] == big_endian(2, 4) + big_endian(0, 4) + "Go?");
}

TEST_CASE("popups are told on the primary interface with the fields of UR's tables", "[ur]") {
  UrRobot robot("ur5e");
  Session& primary = robot.robot.open(Port::kPrimary);
  primary.receive("popup(\"Text\", \"Title\", warning=True, blocking=True)\n");
  robot.run(0.1);
  const auto popups = messages(primary, 2);
  REQUIRE(popups.size() == 1);
  const std::string expected = big_endian(0, 4) + big_endian(8, 4) + std::string("\1\0\1\5", 4) + "TitleText";
  CHECK(popups[0] == expected);
}

}  // namespace firstlook
