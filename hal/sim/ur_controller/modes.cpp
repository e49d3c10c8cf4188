#include "hal/sim/ur_controller/modes.hpp"

namespace firstlook::sim::ur {

std::string_view name_of(RobotMode mode) {
  switch (mode) {
    case RobotMode::kNoController:
      return "NO_CONTROLLER";
    case RobotMode::kDisconnected:
      return "DISCONNECTED";
    case RobotMode::kConfirmSafety:
      return "CONFIRM_SAFETY";
    case RobotMode::kBooting:
      return "BOOTING";
    case RobotMode::kPowerOff:
      return "POWER_OFF";
    case RobotMode::kPowerOn:
      return "POWER_ON";
    case RobotMode::kIdle:
      return "IDLE";
    case RobotMode::kBackdrive:
      return "BACKDRIVE";
    case RobotMode::kRunning:
      return "RUNNING";
    case RobotMode::kUpdatingFirmware:
      return "UPDATING_FIRMWARE";
  }
  return "";
}

std::string_view name_of(SafetyMode mode) {
  switch (mode) {
    case SafetyMode::kNormal:
      return "NORMAL";
    case SafetyMode::kReduced:
      return "REDUCED";
    case SafetyMode::kProtectiveStop:
      return "PROTECTIVE_STOP";
    case SafetyMode::kRecovery:
      return "RECOVERY";
    case SafetyMode::kSafeguardStop:
      return "SAFEGUARD_STOP";
    case SafetyMode::kSystemEmergencyStop:
      return "SYSTEM_EMERGENCY_STOP";
    case SafetyMode::kRobotEmergencyStop:
      return "ROBOT_EMERGENCY_STOP";
    case SafetyMode::kViolation:
      return "VIOLATION";
    case SafetyMode::kFault:
      return "FAULT";
  }
  return "";
}

std::uint8_t joint_mode_of(RobotMode mode) {
  switch (mode) {
    case RobotMode::kPowerOn:
      return kJointBooting;
    case RobotMode::kIdle:
      return kJointIdle;
    case RobotMode::kRunning:
      return kJointRunning;
    default:
      return kJointPowerOff;
  }
}

std::uint8_t tool_mode_of(RobotMode mode) {
  return mode == RobotMode::kIdle || mode == RobotMode::kRunning ? kJointRunning : kJointIdle;
}

}  // namespace firstlook::sim::ur
