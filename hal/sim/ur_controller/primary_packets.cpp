#include "hal/sim/ur_controller/primary_packets.hpp"

#include <cmath>

#include "hal/sim/ur_controller/steady_readings.hpp"
#include "hal/sim/ur_controller/wire.hpp"

namespace firstlook::sim::ur {
namespace {

constexpr std::uint8_t kRobotState = 16;
constexpr std::uint8_t kRobotMessage = 20;
constexpr std::int8_t kSourceController = -3;  // 253 unsigned: what real controllers put there

/// Opens a packet with its length and type; the length is filled in at the end of its life.
class Packet {
 public:
  Packet(WireWriter& wire, std::uint8_t type) : wire_(wire), begin_(wire.size()) {
    wire.u32(0);
    wire.u8(type);
  }
  ~Packet() { wire_.patch_u32(begin_, static_cast<std::uint32_t>(wire_.size() - begin_)); }
  Packet(const Packet&) = delete;
  Packet& operator=(const Packet&) = delete;

 private:
  WireWriter& wire_;
  std::size_t begin_;
};

std::uint64_t microseconds(double s) { return static_cast<std::uint64_t>(std::llround(s * 1e6)); }

void mode_data(const Controller& controller, WireWriter& wire) {
  const ControllerState& s = controller.state();
  const Packet packet(wire, 0);
  wire.u64(microseconds(s.timestamp_s));
  wire.flag(true);  // a real robot is connected
  wire.flag(true);  // and enabled
  wire.flag(s.powered());
  wire.flag(s.emergency_stopped());
  wire.flag(s.safety_mode == SafetyMode::kProtectiveStop);
  wire.flag(s.program_running());
  wire.flag(s.runtime == RuntimeState::kPaused);
  wire.i8(static_cast<std::int8_t>(s.robot_mode));
  wire.u8(s.control_mode());
  wire.f64(s.speed_slider);
  wire.f64(s.speed_scaling);
  wire.f64(1);  // limit of the slider
  wire.u8(0);
}

void joint_data(const Controller& controller, WireWriter& wire) {
  const ControllerState& s = controller.state();
  const Vector6 currents_a = joint_currents_a(s);
  const Vector6 actual_rad = controller.measured_q_rad();
  const Packet packet(wire, 1);
  for (std::size_t j = 0; j < kJoints; ++j) {
    wire.f64(actual_rad[j]);
    wire.f64(s.q_rad[j]);
    wire.f64(s.qd_rad_s[j]);
    wire.f32(currents_a[j]);
    wire.f32(robot_voltage_v(s));
    wire.f32(kJointTemperatures_c[j]);
    wire.f32(0);
    wire.u8(joint_mode_of(s.robot_mode));
  }
}

void tool_data(const Controller& controller, WireWriter& wire) {
  const ControllerState& s = controller.state();
  const Packet packet(wire, 2);
  wire.u8(s.io.tool_analog_types & 1);
  wire.u8(s.io.tool_analog_types >> 1 & 1);
  wire.f64(s.io.tool_analog_inputs[0]);
  wire.f64(s.io.tool_analog_inputs[1]);
  wire.f32(robot_voltage_v(s));
  wire.u8(static_cast<std::uint8_t>(s.io.tool_voltage_v));
  wire.f32(0);
  wire.f32(kToolTemperature_c);
  wire.u8(tool_mode_of(s.robot_mode));
}

void masterboard_data(const Controller& controller, WireWriter& wire) {
  const ControllerState& s = controller.state();
  const InputsOutputs& io = s.io;
  const Packet packet(wire, 3);
  wire.u32(static_cast<std::uint32_t>(io.digital_inputs));
  wire.u32(static_cast<std::uint32_t>(io.digital_outputs));
  wire.u8(io.analog_types & 1);
  wire.u8(io.analog_types >> 1 & 1);
  wire.f64(io.analog_inputs[0]);
  wire.f64(io.analog_inputs[1]);
  wire.u8(io.analog_types >> 2 & 1);
  wire.u8(io.analog_types >> 3 & 1);
  wire.f64(io.analog_outputs[0]);
  wire.f64(io.analog_outputs[1]);
  wire.f32(kBoardTemperature_c);
  wire.f32(robot_voltage_v(s));
  wire.f32(robot_current_a(s));
  wire.f32(kIoCurrent_ma / 1000);
  wire.u8(static_cast<std::uint8_t>(s.safety_mode));
  wire.flag(s.safety_mode == SafetyMode::kReduced);
  wire.u8(0);  // no Euromap 67
  wire.u32(0);
  wire.u8(0);  // operational mode selector
  wire.u8(1);  // three-position enabling device
  if (controller.identity().series == Series::kESeries) wire.u8(0);
}

void cartesian_info(const Controller& controller, WireWriter& wire) {
  const Packet packet(wire, 4);
  wire.f64s(controller.measured_tcp_pose());
  wire.f64s(controller.state().tcp_offset);
}

/// The columns theta, a, d, alpha, in the order that the two packages with DH tables ask for.
using Column = double DhRow::*;
void dh_column(const ArmModel& arm, Column column, WireWriter& wire) {
  for (std::size_t j = 0; j < kJoints; ++j) wire.f64(arm.dh[j].*column);
}

void kinematics_info(const Controller& controller, WireWriter& wire) {
  const ControllerIdentity& identity = controller.identity();
  const Packet packet(wire, 5);
  for (const std::uint32_t checksum : identity.kinematics_checksums) wire.u32(checksum);
  for (const Column column : {&DhRow::theta_offset_rad, &DhRow::a_m, &DhRow::d_m, &DhRow::alpha_rad}) {
    dh_column(identity.arm, column, wire);
  }
  wire.u32(1);  // calibrated
}

void configuration_data(const Controller& controller, WireWriter& wire) {
  const ControllerIdentity& identity = controller.identity();
  const ArmModel& arm = identity.nominal;
  const Packet packet(wire, 6);
  for (std::size_t j = 0; j < kJoints; ++j) {
    wire.f64(-2 * M_PI);
    wire.f64(2 * M_PI);
  }
  for (std::size_t j = 0; j < kJoints; ++j) {
    wire.f64(arm.speed_max_rad_s[j]);
    wire.f64(arm.acceleration_max_rad_s2);
  }
  wire.f64(1.05);  // defaults of movej and movel: rad/s, rad/s², m/s, m/s²
  wire.f64(1.4);
  wire.f64(0.25);
  wire.f64(1.2);
  wire.f64(0);  // equivalent radius
  for (const Column column : {&DhRow::a_m, &DhRow::d_m, &DhRow::alpha_rad, &DhRow::theta_offset_rad}) {
    dh_column(arm, column, wire);
  }
  wire.i32(identity.series == Series::kCb3 ? 3 : 5);  // masterboard
  wire.i32(1);                                        // control box
  wire.i32(identity.robot_type);
  wire.i32(identity.series == Series::kCb3 ? 0 : 1);
}

void force_mode_data(const Controller& controller, WireWriter& wire) {
  const Packet packet(wire, 7);
  wire.f64s(controller.state().external_wrench);
  wire.f64(0);
}

void additional_info(const Controller& controller, WireWriter& wire) {
  const Packet packet(wire, 8);
  wire.flag(controller.state().freedrive);  // its button is pressed
  wire.flag(true);                          // enabled
  wire.flag(false);
  wire.u8(0);
}

void tool_communication_info(WireWriter& wire) {
  const Packet packet(wire, 11);
  wire.flag(false);
  wire.i32(115200);
  wire.i32(0);
  wire.i32(1);
  wire.f32(1.5);
  wire.f32(3.5);
}

void tool_mode_info(WireWriter& wire) {
  const Packet packet(wire, 12);
  wire.u8(0);
  wire.u8(0);
  wire.u8(0);
}

void popup_message(const ControllerEvent& event, WireWriter& wire) {
  wire.u32(0);  // request id
  wire.u32(static_cast<std::uint32_t>(RequestedType::kNone));
  wire.flag(event.warning);
  wire.flag(event.error);
  wire.flag(event.blocking);
  wire.u8(static_cast<std::uint8_t>(event.title.size()));
  wire.text(event.title);
  wire.text(event.text);
}

}  // namespace

std::string version_message(const Controller& controller) {
  constexpr std::string_view kProject = "URControl";
  const ControllerIdentity& identity = controller.identity();
  std::string bytes;
  WireWriter wire(bytes);
  {
    const Packet packet(wire, kRobotMessage);
    wire.u64(microseconds(controller.state().timestamp_s));
    wire.i8(kSourceController);
    wire.u8(3);
    wire.u8(static_cast<std::uint8_t>(kProject.size()));
    wire.text(kProject);
    wire.u8(static_cast<std::uint8_t>(identity.version.major));
    wire.u8(static_cast<std::uint8_t>(identity.version.minor));
    wire.i32(identity.version.bugfix);
    wire.i32(identity.version.build);
    wire.text(identity.build_date);
  }
  return bytes;
}

std::string robot_state_message(const Controller& controller) {
  std::string bytes;
  WireWriter wire(bytes);
  {
    const Packet packet(wire, kRobotState);
    mode_data(controller, wire);
    joint_data(controller, wire);
    tool_data(controller, wire);
    masterboard_data(controller, wire);
    cartesian_info(controller, wire);
    kinematics_info(controller, wire);
    configuration_data(controller, wire);
    force_mode_data(controller, wire);
    additional_info(controller, wire);
    if (controller.identity().series == Series::kESeries) {
      tool_communication_info(wire);
      tool_mode_info(wire);
    }
  }
  return bytes;
}

std::string event_message(const ControllerEvent& event) {
  using Kind = ControllerEvent::Kind;
  std::string bytes;
  WireWriter wire(bytes);
  {
    const Packet packet(wire, kRobotMessage);
    wire.u64(microseconds(event.timestamp_s));
    wire.i8(kSourceController);
    switch (event.kind) {
      case Kind::kText:
        wire.u8(0);
        wire.text(event.text);
        break;
      case Kind::kLabel:
        wire.u8(1);
        wire.i32(event.code);
        wire.text(event.text);
        break;
      case Kind::kPopup:
        wire.u8(2);
        popup_message(event, wire);
        break;
      case Kind::kSafetyMode:
        wire.u8(5);
        wire.i32(event.code);
        wire.i32(0);
        wire.u8(static_cast<std::uint8_t>(event.argument));
        wire.u32(0);
        wire.u32(0);
        break;
      case Kind::kErrorCode:
        wire.u8(6);
        wire.i32(event.code);
        wire.i32(event.argument);
        wire.i32(event.error ? 3 : event.warning ? 2 : 1);  // report level: fault, warning, info
        wire.u32(0);
        wire.u32(0);
        wire.text(event.text);
        break;
      case Kind::kKey:
        wire.u8(7);
        wire.i32(event.code);
        wire.i32(event.argument);
        wire.u8(static_cast<std::uint8_t>(event.title.size()));
        wire.text(event.title);
        wire.text(event.text);
        break;
      case Kind::kRequest:
        wire.u8(9);
        wire.i32(event.code);
        wire.i32(event.argument);
        wire.text(event.text);
        break;
      case Kind::kRuntimeException:
        wire.u8(10);
        wire.i32(event.code);
        wire.i32(event.argument);
        wire.text(event.text);
        break;
    }
  }
  return bytes;
}

}  // namespace firstlook::sim::ur
