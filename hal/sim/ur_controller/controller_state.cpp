#include "hal/sim/ur_controller/controller_state.hpp"

namespace firstlook::sim::ur {

std::uint32_t robot_status_bits(const ControllerState& state) {
  const std::uint32_t power = state.powered() ? 1 : 0;
  const std::uint32_t running = state.program_running() ? 1 : 0;
  const std::uint32_t teach = state.freedrive ? 1 : 0;
  return power | running << 1 | teach << 2;
}

std::uint32_t safety_status_bits(const ControllerState& state) {
  const SafetyMode mode = state.safety_mode;
  const auto bit = [](bool value, int at) { return value ? 1U << at : 0U; };
  const bool stopped = mode != SafetyMode::kNormal && mode != SafetyMode::kReduced && mode != SafetyMode::kRecovery;
  return bit(mode == SafetyMode::kNormal, 0) | bit(mode == SafetyMode::kReduced, 1) |
         bit(mode == SafetyMode::kProtectiveStop, 2) | bit(mode == SafetyMode::kRecovery, 3) |
         bit(mode == SafetyMode::kSafeguardStop, 4) | bit(mode == SafetyMode::kSystemEmergencyStop, 5) |
         bit(mode == SafetyMode::kRobotEmergencyStop, 6) | bit(state.emergency_stopped(), 7) |
         bit(mode == SafetyMode::kViolation, 8) | bit(mode == SafetyMode::kFault, 9) | bit(stopped, 10);
}

}  // namespace firstlook::sim::ur
