/// The modes of a UR controller with the numbers that its interfaces send and the words of its dashboard.
#pragma once

#include <cstdint>
#include <string_view>

namespace firstlook::sim::ur {

enum class RobotMode : std::int8_t {
  kNoController = -1,
  kDisconnected = 0,
  kConfirmSafety = 1,
  kBooting = 2,
  kPowerOff = 3,
  kPowerOn = 4,
  kIdle = 5,
  kBackdrive = 6,
  kRunning = 7,
  kUpdatingFirmware = 8,
};

/// Of `safety_mode` and, where the controller has it, of `safety_status`: the simulated one never uses 10 and 11, which
/// tell the inputs of a safeguard stop apart.
enum class SafetyMode : std::uint8_t {
  kNormal = 1,
  kReduced = 2,
  kProtectiveStop = 3,
  kRecovery = 4,
  kSafeguardStop = 5,
  kSystemEmergencyStop = 6,
  kRobotEmergencyStop = 7,
  kViolation = 8,
  kFault = 9,
};

enum class RuntimeState : std::uint32_t {
  kStopping = 0,
  kStopped = 1,
  kPlaying = 2,
  kPausing = 3,
  kPaused = 4,
  kResuming = 5,
};

// Joint modes and tool modes, from the same published tables.
inline constexpr std::uint8_t kJointPowerOff = 239;
inline constexpr std::uint8_t kJointBooting = 247;
inline constexpr std::uint8_t kJointRunning = 253;
inline constexpr std::uint8_t kJointIdle = 255;

/// "POWER_OFF", ... as `robotmode` of the dashboard says it.
[[nodiscard]] std::string_view name_of(RobotMode mode);
/// "NORMAL", "PROTECTIVE_STOP", ... as `safetymode` and `safetystatus` say it.
[[nodiscard]] std::string_view name_of(SafetyMode mode);

/// What every joint reports in this mode.
[[nodiscard]] std::uint8_t joint_mode_of(RobotMode mode);
[[nodiscard]] std::uint8_t tool_mode_of(RobotMode mode);

}  // namespace firstlook::sim::ur
