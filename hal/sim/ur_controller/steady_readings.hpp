/// What a controller measures and this one only makes up: plausible for a UR5, the same at every call.
#pragma once

#include "hal/sim/ur_controller/controller_state.hpp"

namespace firstlook::sim::ur {

inline constexpr Vector6 kJointTemperatures_c = {29, 30, 30, 32, 33, 33};
inline constexpr double kToolTemperature_c = 31;
inline constexpr double kBoardTemperature_c = 34;
inline constexpr double kMainVoltage_v = 48.1;
inline constexpr double kIoCurrent_ma = 70;
inline constexpr double kExecutionTime_ms = 0.2;

[[nodiscard]] inline double robot_voltage_v(const ControllerState& state) { return state.powered() ? 48.0 : 0.0; }
[[nodiscard]] inline double robot_current_a(const ControllerState& state) { return state.powered() ? 0.9 : 0.0; }

/// Of holding the arm up with the brakes off: shoulder and elbow the most. No dynamics.
[[nodiscard]] inline Vector6 joint_currents_a(const ControllerState& state) {
  if (state.robot_mode != RobotMode::kRunning) return {};
  return {0, -2.1, -1.4, -0.4, 0, 0};
}
[[nodiscard]] inline Vector6 joint_moments_nm(const ControllerState& state) {
  Vector6 moments = joint_currents_a(state);
  for (double& moment : moments) moment *= 11;  // torque of a joint for each ampere, about
  return moments;
}

/// Gravity alone, in the tool's frame: what an accelerometer at rest shows.
[[nodiscard]] inline Vector3 tool_acceleration(const ControllerState& state) {
  const Eigen::Vector3d up = pose_of(state.tcp_pose).linear().transpose() * Eigen::Vector3d(0, 0, 9.82);
  return {up.x(), up.y(), up.z()};
}

}  // namespace firstlook::sim::ur
