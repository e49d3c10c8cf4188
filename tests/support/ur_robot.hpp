/// A simulated UR controller in process: time passes when a test says so.
#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "hal/sim/ur_controller/simulated_ur.hpp"

namespace firstlook::test {

struct UrRobot {
  sim::ur::SimulatedUr robot;

  explicit UrRobot(const char* model, bool running = true, std::vector<sim::ur::StoredProgram> programs = {})
      : robot(*sim::ur::identify_controller(model, 0, ""), {std::move(programs), running}) {}

  [[nodiscard]] const sim::ur::ControllerState& state() { return robot.controller().state(); }
  void run(double s) {
    const auto cycles = static_cast<int>(s * robot.controller().identity().frequency_hz() + 0.5);
    for (int i = 0; i < cycles; ++i) robot.step();
  }
  /// One line to the dashboard, and its answer without the line end: time passes until it comes.
  std::string dashboard(const std::string& line) {
    sim::ur::Session& session = robot.open(sim::ur::Port::kDashboard);
    session.output().clear();
    session.receive(line + "\n");
    for (int i = 0; i < 5000 && session.output().empty(); ++i) robot.step();
    std::string answer = session.output();
    robot.close(session);
    REQUIRE(!answer.empty());
    REQUIRE(answer.back() == '\n');
    answer.pop_back();
    return answer;
  }
};

}  // namespace firstlook::test
