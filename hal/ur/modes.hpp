/// The numbers by which a UR controller tells its modes, on RTDE and on the primary interface alike.
#pragma once

#include <cstdint>
#include <string_view>

namespace firstlook::ur {

inline constexpr int kRobotModeRunning = 7;
[[nodiscard]] constexpr std::string_view robot_mode_name(int mode) {
  constexpr std::string_view kNames[] = {"no controller", "disconnected", "confirm safety", "booting", "power off",
                                         "power on",      "idle",         "backdrive",      "running", "updating"};
  return mode >= -1 && mode <= 8 ? kNames[mode + 1] : "unknown";
}

inline constexpr int kSafetyNormal = 1;
inline constexpr int kSafetyReduced = 2;
inline constexpr int kSafetyProtectiveStop = 3;
inline constexpr int kSafetyRecovery = 4;
inline constexpr int kSafetySafeguardStop = 5;
inline constexpr int kSafetySystemEmergencyStop = 6;
inline constexpr int kSafetyRobotEmergencyStop = 7;
inline constexpr int kSafetyViolation = 8;
inline constexpr int kSafetyFault = 9;
[[nodiscard]] constexpr std::string_view safety_mode_name(int mode) {
  constexpr std::string_view kNames[] = {"normal",
                                         "reduced",
                                         "protective stop",
                                         "recovery",
                                         "safeguard stop",
                                         "system emergency stop",
                                         "robot emergency stop",
                                         "violation",
                                         "fault"};
  return mode >= 1 && mode <= 9 ? kNames[mode - 1] : "another stop";
}

enum class Runtime : std::uint8_t { kStopping, kStopped, kPlaying, kPausing, kPaused, kResuming, kUnknown };

}  // namespace firstlook::ur
