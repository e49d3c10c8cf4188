/// What every pendant and panel must do, whoever implements it.
#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>
#include <string>

#include "hal/can/can_panel.hpp"
#include "hal/sim/simulated_operator.hpp"
#include "tests/support/mock_panel.hpp"
#include "tests/support/mock_pendant.hpp"
#include "tests/support/simulated_can_kernel.hpp"

using namespace firstlook;

namespace {

Instant at(double t_s) { return Instant{seconds(t_s).ns}; }

sim::OperatorScript script() {
  sim::OperatorScript s;
  s.push_back({at(2), hal::OperatorAction::kStop});
  s.push_back({at(1), hal::OperatorAction::kPlay});
  return s;
}

struct SimulatedPendant {
  sim::SimulatedPendant device{script()};
  void tell() { device.show("calibrating, view 3 of 12"); }
  bool told() const { return device.shown() == "calibrating, view 3 of 12" && device.lines_shown() == 1; }
};
struct SimulatedPanel {
  sim::SimulatedPanel device{script()};
  void tell() { device.light(hal::Light::kAmber); }
  bool told() const { return device.lit() == hal::Light::kAmber; }
};
struct MockPendant {
  MockPendant() {
    for (const hal::OperatorEvent& event : script()) device.keys.press(event.stamp, event.action);
  }
  mock::MockPendant device;
  void tell() { device.show("calibrating, view 3 of 12"); }
  bool told() const { return device.lines == std::vector<std::string>{"calibrating, view 3 of 12"}; }
};
struct MockPanel {
  MockPanel() {
    for (const hal::OperatorEvent& event : script()) device.keys.press(event.stamp, event.action);
  }
  mock::MockPanel device;
  void tell() { device.light(hal::Light::kAmber); }
  bool told() const { return device.lights == std::vector<hal::Light>{hal::Light::kAmber}; }
};

/// The CAN driver with a simulated module on a simulated bus.
struct DrivenPanel {
  DrivenPanel() {
    kernel.attach(node);
    node.power(true);
  }
  static std::string sheet() {
    std::ifstream file(FIRSTLOOK_SOURCE_DIR "/hal/can/firstlook_panel.eds");
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void tell() { device.light(hal::Light::kAmber); }
  bool told() {
    for (int ms = 0; ms < 1000; ++ms) {
      kernel.turn(Instant{} + milliseconds(ms));
      (void)device.poll(Instant{} + milliseconds(ms));
    }
    return node.lamps() == can::output_bits({}, hal::Light::kAmber, false);
  }
  test::SimulatedCanKernel kernel;
  test::SimulatedIoNode node{sheet(), 10};
  can::CanPanel device{kernel, {}};
};

}  // namespace

TEMPLATE_TEST_CASE("keys come once, in order, and not before they are pressed", "[hal][operator]", SimulatedPendant,
                   SimulatedPanel, MockPendant, MockPanel) {
  TestType d;
  CHECK(d.device.next_due() == at(1));
  CHECK_FALSE(d.device.poll(at(0.99)).has_value());
  const auto first = d.device.poll(at(1));
  REQUIRE(first.has_value());
  CHECK(first->action == hal::OperatorAction::kPlay);
  CHECK(first->stamp == at(1));
  CHECK_FALSE(d.device.poll(at(1)).has_value());
  CHECK(d.device.next_due() == at(2));
  const auto second = d.device.poll(at(5));  // late
  REQUIRE(second.has_value());
  CHECK(second->action == hal::OperatorAction::kStop);
  CHECK(second->stamp == at(2));
  CHECK_FALSE(d.device.poll(at(100)).has_value());
  CHECK(d.device.next_due() > at(1e6));
}

TEMPLATE_TEST_CASE("what is shown arrives", "[hal][operator]", SimulatedPendant, SimulatedPanel, MockPendant, MockPanel,
                   DrivenPanel) {
  TestType d;
  d.tell();
  CHECK(d.told());
}

TEST_CASE("a pendant cuts a line that does not fit its display", "[hal][operator]") {
  sim::SimulatedPendant pendant{script()};
  const std::string line(1000, 'x');
  pendant.show(line);
  CHECK(pendant.shown() == line.substr(0, sim::SimulatedPendant::kLineMax));
}
