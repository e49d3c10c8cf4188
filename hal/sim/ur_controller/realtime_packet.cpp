#include "hal/sim/ur_controller/realtime_packet.hpp"

#include "hal/sim/ur_controller/steady_readings.hpp"
#include "hal/sim/ur_controller/wire.hpp"

namespace firstlook::sim::ur {

void append_realtime_packet(const Controller& controller, std::string& out) {
  const ControllerState& s = controller.state();
  const Vector6 currents_a = joint_currents_a(s);
  WireWriter wire(out);
  const std::size_t begin = wire.size();
  const auto unused = [&wire](int count) {
    for (int i = 0; i < count; ++i) wire.f64(0);
  };
  const auto six = [&wire](double value) {
    for (std::size_t j = 0; j < kJoints; ++j) wire.f64(value);
  };
  wire.u32(0);
  wire.f64(s.timestamp_s);
  wire.f64s(s.q_rad);
  wire.f64s(s.qd_rad_s);
  wire.f64s(s.qdd_rad_s2);
  wire.f64s(currents_a);
  wire.f64s(joint_moments_nm(s));
  wire.f64s(controller.measured_q_rad());
  wire.f64s(s.qd_rad_s);
  wire.f64s(currents_a);
  wire.f64s(currents_a);  // control output
  wire.f64s(controller.measured_tcp_pose());
  wire.f64s(s.tcp_speed);
  wire.f64s(s.external_wrench);
  wire.f64s(s.tcp_pose);
  wire.f64s(s.tcp_speed);
  wire.f64(static_cast<double>(s.io.digital_inputs));
  wire.f64s(kJointTemperatures_c);
  wire.f64(kExecutionTime_ms);
  unused(1);  // test value
  wire.f64(static_cast<double>(s.robot_mode));
  six(joint_mode_of(s.robot_mode));
  wire.f64(static_cast<double>(s.safety_mode));
  unused(6);
  wire.f64s(tool_acceleration(s));
  unused(6);
  wire.f64(s.speed_scaling);
  unused(1);  // momentum
  unused(2);
  wire.f64(kMainVoltage_v);
  wire.f64(robot_voltage_v(s));
  wire.f64(robot_current_a(s));
  six(robot_voltage_v(s));
  wire.f64(static_cast<double>(s.io.digital_outputs));
  wire.f64(static_cast<double>(s.runtime));
  wire.f64s(s.elbow_position_m);
  wire.f64s(s.elbow_velocity_m_s);
  wire.f64(static_cast<double>(s.safety_mode));  // safety status
  if (controller.identity().series == Series::kESeries) {
    unused(3);
    wire.f64(s.payload.mass_kg);
    wire.f64s(s.payload.center_m);
    wire.f64s(s.payload.inertia_kg_m2);
  }
  wire.patch_u32(begin, static_cast<std::uint32_t>(wire.size() - begin));
}

}  // namespace firstlook::sim::ur
