#include "hal/sim/ur_controller/truth_session.hpp"

#include <algorithm>

#include "hal/sim/ur_controller/wire.hpp"

namespace firstlook::sim::ur {
namespace {
constexpr double kFrequency_hz = 125;
}

TruthSession::TruthSession(Controller& controller)
    : controller_(controller),
      every_cycles_(static_cast<std::uint64_t>(controller.identity().frequency_hz() / kFrequency_hz)) {
  WireWriter wire(output());
  wire.text(kTruthGreeting);
  for (std::size_t j = 0; j < kJoints; ++j) {
    const DhRow& row = controller.identity().arm.dh[j];
    for (const double value : {row.theta_offset_rad, row.d_m, row.a_m, row.alpha_rad}) wire.f64(value);
  }
}

void TruthSession::receive(std::string_view bytes) {
  if (bytes.find(kTouched) != std::string_view::npos) controller_.protective_stop("the arm touches something");
}

void TruthSession::on_cycle() {
  const ControllerState& state = controller_.state();
  if (state.control_step % every_cycles_ != 0) return;
  WireWriter wire(output());
  wire.f64(controller_.simulated_s());
  wire.f64s(state.q_rad);
}

}  // namespace firstlook::sim::ur
