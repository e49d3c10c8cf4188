/// Everything that the interfaces of a controller report: one plain snapshot, renewed each control cycle.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "hal/sim/ur_controller/modes.hpp"
#include "hal/sim/ur_controller/rotation_vector.hpp"

namespace firstlook::sim::ur {

using Vector3 = std::array<double, 3>;

inline constexpr std::size_t kRegisters = 48;

/// General purpose registers, one set for each direction.
struct Registers {
  std::array<std::uint32_t, 4> bits{};  ///< 0..63 for fieldbuses, 64..127 for RTDE clients
  std::array<std::int32_t, kRegisters> integers{};
  std::array<double, kRegisters> doubles{};

  [[nodiscard]] bool bit(std::size_t i) const { return (bits[i / 32] >> (i % 32) & 1) != 0; }
  void set_bit(std::size_t i, bool value) {
    const std::uint32_t mask = 1U << (i % 32);
    bits[i / 32] = value ? bits[i / 32] | mask : bits[i / 32] & ~mask;
  }
};

struct Payload {
  double mass_kg = 0;
  Vector3 center_m{};
  Vector6 inertia_kg_m2{};
};

// Bits of digital inputs and outputs: 0-7 standard, 8-15 configurable, 16-17 tool.
inline constexpr int kConfigurableBit = 8;
inline constexpr int kToolBit = 16;
inline constexpr int kDigitalBits = 18;

struct InputsOutputs {
  std::uint64_t digital_inputs = 0, digital_outputs = 0;
  // Bits 0, 1: analog inputs, 2, 3: analog outputs; 0 mA, 1 V.
  std::uint32_t analog_types = 0;
  std::array<double, 2> analog_inputs{}, analog_outputs{};  ///< mA or V
  std::uint32_t tool_analog_types = 0b11;
  std::array<double, 2> tool_analog_inputs{};
  int tool_voltage_v = 0;
  std::array<bool, 32> flags{};  ///< outputs without a wire: they outlive programs, too

  [[nodiscard]] bool output(int bit) const { return (digital_outputs >> bit & 1) != 0; }
  void set_output(int bit, bool value) {
    const std::uint64_t mask = std::uint64_t{1} << bit;
    digital_outputs = value ? digital_outputs | mask : digital_outputs & ~mask;
  }
};

struct ControllerState {
  double timestamp_s = 0;  ///< since the controller was started
  std::uint64_t control_step = 0;
  RobotMode robot_mode = RobotMode::kPowerOff;
  SafetyMode safety_mode = SafetyMode::kNormal;
  RuntimeState runtime = RuntimeState::kStopped;

  Vector6 q_rad{}, qd_rad_s{}, qdd_rad_s2{};
  Vector6 tcp_offset{};  ///< flange_T_tcp
  Vector6 tcp_pose{}, tcp_speed{};
  Vector3 elbow_position_m{}, elbow_velocity_m_s{};

  double speed_slider = 1;  ///< `target_speed_fraction`
  double speed_scaling = 0;
  Payload payload;
  Vector6 external_wrench{};
  /// What holds the base up against gravity, in Base (m/s²): how the robot is mounted. Upright, as factories set it.
  Vector3 gravity_m_s2{0, 0, 9.82};
  InputsOutputs io;
  Registers inputs, outputs;
  bool freedrive = false;         ///< its button is pressed
  bool teach_mode = false;        ///< a program, or a command, has put the arm into freedrive: no button is needed
  std::uint32_t script_line = 0;  ///< that has the arm under its control; 0 for none

  [[nodiscard]] bool powered() const { return robot_mode == RobotMode::kIdle || robot_mode == RobotMode::kRunning; }
  [[nodiscard]] bool program_running() const { return runtime != RuntimeState::kStopped; }
  /// What the primary interface calls control mode: 0 position, 1 teach.
  [[nodiscard]] std::uint8_t control_mode() const { return freedrive || teach_mode ? 1 : 0; }
  [[nodiscard]] bool emergency_stopped() const {
    return safety_mode == SafetyMode::kRobotEmergencyStop || safety_mode == SafetyMode::kSystemEmergencyStop;
  }
};

/// Bits 0-3 of `robot_status_bits`: power on, program running, teach button, power button.
[[nodiscard]] std::uint32_t robot_status_bits(const ControllerState& state);
/// Bits 0-10 of `safety_status_bits`, in the order of the RTDE guide.
[[nodiscard]] std::uint32_t safety_status_bits(const ControllerState& state);

}  // namespace firstlook::sim::ur
