/// A simulated UR controller that runs what a client sends to its primary port, and what it tells about it.
#pragma once

#include <string>
#include <vector>

#include "tests/support/ur_robot.hpp"
#include "tests/support/ur_wire.hpp"

namespace firstlook::test {

/// A robot with a client on its primary port.
struct ScriptRobot : UrRobot {
  sim::ur::Session& primary;
  std::vector<std::string> texts, keys;
  struct Exception {
    int line, column;
    std::string text;
  };
  std::vector<Exception> exceptions;

  explicit ScriptRobot(const char* model = "ur5e") : UrRobot(model), primary(robot.open(sim::ur::Port::kPrimary)) {}

  void send(const std::string& script, double run_s = 0.5) {
    primary.receive(script);
    listen(run_s);
  }
  void listen(double run_s) {
    run(run_s);
    for (const UrPacket& packet : take_packets(primary.output())) {
      if (packet.type != 20) continue;
      const std::string content = packet.content.substr(10);
      if (packet.content[9] == 0) texts.push_back(content);
      if (packet.content[9] == 7) keys.push_back(content.substr(9));
      if (packet.content[9] == 10) exceptions.push_back({int_at(content, 0), int_at(content, 4), content.substr(8)});
    }
  }
  /// What textmsg says of an expression.
  std::string value(const std::string& expression) {
    texts.clear();
    exceptions.clear();
    send("def f():\n  x = " + expression + "\n  textmsg(x)\nend\n", 0.1);
    if (!exceptions.empty()) return "! " + exceptions[0].text;
    REQUIRE(texts.size() == 1);
    return texts[0];
  }
};

}  // namespace firstlook::test
