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
  received_.append(bytes);
  std::size_t at = 0;
  while (!over() && at < received_.size()) {
    if (received_[at] == kTouched) {
      controller_.protective_stop("the arm touches something");
      ++at;
    } else if (received_[at] != kLead) {
      end();
    } else if (received_.size() - at < kLeadBytes) {
      break;
    } else {
      WireReader wire(std::string_view(received_).substr(at + 1, kLeadBytes - 1));
      JointVector to_rad = JointVector::zero(6);
      for (int j = 0; j < 6; ++j) to_rad[j] = wire.f64();
      const double speed_rad_s = wire.f64(), acceleration_rad_s2 = wire.f64();
      if (speed_rad_s > 0 && acceleration_rad_s2 > 0) {
        static_cast<void>(controller_.lead(to_rad, speed_rad_s, acceleration_rad_s2));
      }
      at += kLeadBytes;
    }
  }
  received_.erase(0, at);
}

void TruthSession::on_cycle() {
  const ControllerState& state = controller_.state();
  if (state.control_step % every_cycles_ != 0) return;
  WireWriter wire(output());
  wire.f64(controller_.simulated_s());
  const JointVector q_rad = controller_.motion().true_position_rad();
  for (int j = 0; j < 6; ++j) wire.f64(q_rad[j]);
  wire.flag(controller_.motion().led());
}

std::string lead_message(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2) {
  std::string message(1, kLead);
  WireWriter wire(message);
  for (int j = 0; j < 6; ++j) wire.f64(to_rad[j]);
  wire.f64(speed_rad_s);
  wire.f64(acceleration_rad_s2);
  return message;
}

}  // namespace firstlook::sim::ur
