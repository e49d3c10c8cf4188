#include "hal/sim/ur_controller/rtde_table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "hal/sim/ur_controller/steady_readings.hpp"

namespace firstlook::sim::ur {
namespace {

/// Since when the two generations have a name.
struct Since {
  SoftwareVersion cb3, e_series;
};
constexpr SoftwareVersion kNever{99};
constexpr Since kAlways{{3, 4}, {5, 0}};
constexpr Since kFrom3_9{{3, 9}, {5, 3}};
constexpr Since kESeriesOnly{kNever, {5, 0}};

using T = RtdeType;
using C = const Controller&;
using W = WireWriter&;

/// A row whose name ends in `*` stands for all numbers from `first` to `last` in its place.
struct OutputRow {
  std::string_view name;
  T type;
  Since since;
  void (*write)(C, int, W);
  int first = 0, last = 0;
};
struct InputRow {
  std::string_view name;
  T type;
  Since since;
  void (*read)(Controller&, RtdeInputs&, int, WireReader&);
  int first = 0, last = 0;
};

void none(C, int, W wire) { wire.f64(0); }
void none6(C, int, W wire) { wire.f64s(Vector6{}); }
void none_u32(C, int, W wire) { wire.u32(0); }
void none_u8(C, int, W wire) { wire.u8(0); }
void none_i32(C, int, W wire) { wire.i32(0); }
void q(C c, int, W wire) { wire.f64s(c.state().q_rad); }
void measured_q(C c, int, W wire) { wire.f64s(c.measured_q_rad()); }
void qd(C c, int, W wire) { wire.f64s(c.state().qd_rad_s); }
void tcp_pose(C c, int, W wire) { wire.f64s(c.state().tcp_pose); }
void measured_tcp_pose(C c, int, W wire) { wire.f64s(c.measured_tcp_pose()); }
void tcp_speed(C c, int, W wire) { wire.f64s(c.state().tcp_speed); }
void tcp_force(C c, int, W wire) { wire.f64s(c.state().external_wrench); }
void currents(C c, int, W wire) { wire.f64s(joint_currents_a(c.state())); }
void safety(C c, int, W wire) { wire.i32(static_cast<std::int32_t>(c.state().safety_mode)); }

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// From the RTDE guide, in its order. Names that later versions than ours brought are not here.
constexpr OutputRow kOutputs[] = {
    {"timestamp", T::kDouble, kAlways, [](C c, int, W w) { w.f64(c.state().timestamp_s); }},
    {"target_q", T::kVector6d, kAlways, q},
    {"target_qd", T::kVector6d, kAlways, qd},
    {"target_qdd", T::kVector6d, kAlways, [](C c, int, W w) { w.f64s(c.state().qdd_rad_s2); }},
    {"target_current", T::kVector6d, kAlways, currents},
    {"target_moment", T::kVector6d, kAlways, [](C c, int, W w) { w.f64s(joint_moments_nm(c.state())); }},
    {"actual_q", T::kVector6d, kAlways, measured_q},
    {"actual_qd", T::kVector6d, kAlways, qd},
    {"actual_current", T::kVector6d, kAlways, currents},
    {"actual_current_window", T::kVector6d, kAlways, none6},
    {"joint_control_output", T::kVector6d, kAlways, currents},
    {"actual_TCP_pose", T::kVector6d, kAlways, measured_tcp_pose},
    {"actual_TCP_speed", T::kVector6d, kAlways, tcp_speed},
    {"actual_TCP_force", T::kVector6d, kAlways, tcp_force},
    {"target_TCP_pose", T::kVector6d, kAlways, tcp_pose},
    {"target_TCP_speed", T::kVector6d, kAlways, tcp_speed},
    {"actual_digital_input_bits", T::kUint64, kAlways, [](C c, int, W w) { w.u64(c.state().io.digital_inputs); }},
    {"joint_temperatures", T::kVector6d, kAlways, [](C, int, W w) { w.f64s(kJointTemperatures_c); }},
    {"actual_execution_time", T::kDouble, kAlways, [](C, int, W w) { w.f64(kExecutionTime_ms); }},
    {"robot_mode", T::kInt32, kAlways, [](C c, int, W w) { w.i32(static_cast<std::int32_t>(c.state().robot_mode)); }},
    {"joint_mode", T::kVector6Int32, kAlways,
     [](C c, int, W w) {
       for (std::size_t j = 0; j < kJoints; ++j) w.i32(joint_mode_of(c.state().robot_mode));
     }},
    {"safety_mode", T::kInt32, kAlways, safety},
    {"safety_status", T::kInt32, {{3, 10}, {5, 4}}, safety},
    {"actual_tool_accelerometer", T::kVector3d, kAlways, [](C c, int, W w) { w.f64s(tool_acceleration(c.state())); }},
    {"speed_scaling", T::kDouble, kAlways, [](C c, int, W w) { w.f64(c.state().speed_scaling); }},
    {"target_speed_fraction", T::kDouble, kAlways, [](C c, int, W w) { w.f64(c.state().speed_slider); }},
    {"actual_momentum", T::kDouble, kAlways, none},
    {"actual_main_voltage", T::kDouble, kAlways, [](C, int, W w) { w.f64(kMainVoltage_v); }},
    {"actual_robot_voltage", T::kDouble, kAlways, [](C c, int, W w) { w.f64(robot_voltage_v(c.state())); }},
    {"actual_robot_current", T::kDouble, kAlways, [](C c, int, W w) { w.f64(robot_current_a(c.state())); }},
    {"actual_joint_voltage", T::kVector6d, kAlways,
     [](C c, int, W w) {
       for (std::size_t j = 0; j < kJoints; ++j) w.f64(robot_voltage_v(c.state()));
     }},
    {"actual_digital_output_bits", T::kUint64, kAlways, [](C c, int, W w) { w.u64(c.state().io.digital_outputs); }},
    {"runtime_state", T::kUint32, kAlways, [](C c, int, W w) { w.u32(static_cast<std::uint32_t>(c.state().runtime)); }},
    {"elbow_position", T::kVector3d, {{3, 5}, {5, 0}}, [](C c, int, W w) { w.f64s(c.state().elbow_position_m); }},
    {"elbow_velocity", T::kVector3d, {{3, 5}, {5, 0}}, [](C c, int, W w) { w.f64s(c.state().elbow_velocity_m_s); }},
    {"robot_status_bits", T::kUint32, kAlways, [](C c, int, W w) { w.u32(robot_status_bits(c.state())); }},
    {"safety_status_bits", T::kUint32, kAlways, [](C c, int, W w) { w.u32(safety_status_bits(c.state())); }},
    {"analog_io_types", T::kUint32, kAlways, [](C c, int, W w) { w.u32(c.state().io.analog_types); }},
    {"standard_analog_input*", T::kDouble, kAlways, [](C c, int i, W w) { w.f64(c.state().io.analog_inputs[at(i)]); },
     0, 1},
    {"standard_analog_output*", T::kDouble, kAlways, [](C c, int i, W w) { w.f64(c.state().io.analog_outputs[at(i)]); },
     0, 1},
    {"io_current", T::kDouble, kAlways, [](C, int, W w) { w.f64(kIoCurrent_ma); }},
    {"euromap67_input_bits", T::kUint32, kAlways, none_u32},
    {"euromap67_output_bits", T::kUint32, kAlways, none_u32},
    {"euromap67_24V_voltage", T::kDouble, kAlways, none},
    {"euromap67_24V_current", T::kDouble, kAlways, none},
    {"tool_mode", T::kUint32, kAlways, [](C c, int, W w) { w.u32(tool_mode_of(c.state().robot_mode)); }},
    {"tool_analog_input_types", T::kUint32, kAlways, [](C c, int, W w) { w.u32(c.state().io.tool_analog_types); }},
    {"tool_analog_input*", T::kDouble, kAlways, [](C c, int i, W w) { w.f64(c.state().io.tool_analog_inputs[at(i)]); },
     0, 1},
    {"tool_output_voltage", T::kInt32, kAlways, [](C c, int, W w) { w.i32(c.state().io.tool_voltage_v); }},
    {"tool_output_current", T::kDouble, kAlways, none},
    {"tool_temperature", T::kDouble, kAlways, [](C, int, W w) { w.f64(kToolTemperature_c); }},
    {"tcp_force_scalar", T::kDouble, kAlways,
     [](C c, int, W w) {
       const Vector6& f = c.state().external_wrench;
       w.f64(std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]));
     }},
    {"output_bit_registers0_to_31", T::kUint32, kAlways, [](C c, int, W w) { w.u32(c.state().outputs.bits[0]); }},
    {"output_bit_registers32_to_63", T::kUint32, kAlways, [](C c, int, W w) { w.u32(c.state().outputs.bits[1]); }},
    {"output_bit_register_*", T::kBool, kFrom3_9, [](C c, int i, W w) { w.flag(c.state().outputs.bit(at(i))); }, 64,
     127},
    {"output_int_register_*", T::kInt32, kAlways, [](C c, int i, W w) { w.i32(c.state().outputs.integers[at(i)]); }, 0,
     47},
    {"output_double_register_*", T::kDouble, kAlways, [](C c, int i, W w) { w.f64(c.state().outputs.doubles[at(i)]); },
     0, 47},
    {"input_bit_registers0_to_31", T::kUint32, kAlways, [](C c, int, W w) { w.u32(c.state().inputs.bits[0]); }},
    {"input_bit_registers32_to_63", T::kUint32, kAlways, [](C c, int, W w) { w.u32(c.state().inputs.bits[1]); }},
    {"input_bit_register_*", T::kBool, kFrom3_9, [](C c, int i, W w) { w.flag(c.state().inputs.bit(at(i))); }, 64, 127},
    {"input_int_register_*", T::kInt32, kAlways, [](C c, int i, W w) { w.i32(c.state().inputs.integers[at(i)]); }, 0,
     47},
    {"input_double_register_*", T::kDouble, kAlways, [](C c, int i, W w) { w.f64(c.state().inputs.doubles[at(i)]); }, 0,
     47},
    {"tool_output_mode", T::kUint8, kAlways, none_u8},
    {"tool_digital_output*_mode", T::kUint8, kAlways, none_u8, 0, 1},
    {"payload", T::kDouble, {{3, 11}, {5, 5, 1}}, [](C c, int, W w) { w.f64(c.state().payload.mass_kg); }},
    {"payload_cog", T::kVector3d, {{3, 11}, {5, 5, 1}}, [](C c, int, W w) { w.f64s(c.state().payload.center_m); }},
    {"payload_inertia",
     T::kVector6d,
     {{3, 15}, {5, 11}},
     [](C c, int, W w) { w.f64s(c.state().payload.inertia_kg_m2); }},
    {"script_control_line", T::kUint32, {{3, 14}, {5, 9}}, [](C c, int, W w) { w.u32(c.state().script_line); }},
    {"ft_raw_wrench", T::kVector6d, {kNever, {5, 9}}, tcp_force},
    {"joint_position_deviation_ratio", T::kDouble, kESeriesOnly, none},
    {"collision_detection_ratio", T::kDouble, kESeriesOnly, none},
    {"encoder*_raw", T::kInt32, kESeriesOnly, none_i32, 0, 1},
    {"tcp_offset", T::kVector6d, {{3, 12}, {5, 5, 1}}, [](C c, int, W w) { w.f64s(c.state().tcp_offset); }},
    {"target_gravity", T::kVector3d, kESeriesOnly, [](C c, int, W w) { w.f64s(c.state().gravity_m_s2); }},
    {"time_scale_source", T::kInt32, kESeriesOnly, none_i32},
};

template <auto Field>
void take_u8(Controller&, RtdeInputs& in, int, WireReader& wire) {
  in.*Field = wire.u8();
}

using I = RtdeInputs&;
using R = WireReader&;
constexpr InputRow kInputs[] = {
    {"speed_slider_mask", T::kUint32, kAlways, [](Controller&, I in, int, R r) { in.speed_slider_mask = r.u32(); }},
    {"speed_slider_fraction", T::kDouble, kAlways,
     [](Controller&, I in, int, R r) { in.speed_slider_fraction = r.f64(); }},
    {"standard_digital_output_mask", T::kUint8, kAlways, take_u8<&RtdeInputs::standard_mask>},
    {"standard_digital_output", T::kUint8, kAlways, take_u8<&RtdeInputs::standard>},
    {"configurable_digital_output_mask", T::kUint8, kAlways, take_u8<&RtdeInputs::configurable_mask>},
    {"configurable_digital_output", T::kUint8, kAlways, take_u8<&RtdeInputs::configurable>},
    {"tool_digital_output_mask", T::kUint8, kAlways, take_u8<&RtdeInputs::tool_mask>},
    {"tool_digital_output", T::kUint8, kAlways, take_u8<&RtdeInputs::tool>},
    {"standard_analog_output_mask", T::kUint8, kAlways, take_u8<&RtdeInputs::analog_mask>},
    {"standard_analog_output_type", T::kUint8, kAlways, take_u8<&RtdeInputs::analog_type>},
    {"standard_analog_output_*", T::kDouble, kAlways, [](Controller&, I in, int i, R r) { in.analog[at(i)] = r.f64(); },
     0, 1},
    {"input_bit_registers0_to_31", T::kUint32, kAlways,
     [](Controller& c, I, int, R r) { c.inputs().bits[0] = r.u32(); }},
    {"input_bit_registers32_to_63", T::kUint32, kAlways,
     [](Controller& c, I, int, R r) { c.inputs().bits[1] = r.u32(); }},
    {"input_bit_register_*", T::kBool, kFrom3_9,
     [](Controller& c, I, int i, R r) { c.inputs().set_bit(at(i), r.u8() != 0); }, 64, 127},
    {"input_int_register_*", T::kInt32, kAlways,
     [](Controller& c, I, int i, R r) { c.inputs().integers[at(i)] = r.i32(); }, 0, 47},
    {"input_double_register_*", T::kDouble, kAlways,
     [](Controller& c, I, int i, R r) { c.inputs().doubles[at(i)] = r.f64(); }, 0, 47},
    {"external_force_torque", T::kVector6d, kAlways,
     [](Controller& c, I, int, R r) {
       Vector6 wrench{};
       for (double& value : wrench) value = r.f64();
       c.set_external_wrench(wrench);
     }},
};

bool has(const Since& since, const ControllerIdentity& identity) {
  return identity.version >= (identity.series == Series::kCb3 ? since.cb3 : since.e_series);
}

/// The number in the place of the row's `*`; 0 for an equal name without one; empty for another name.
std::optional<int> match(std::string_view row, int first, int last, std::string_view name) {
  const std::size_t star = row.find('*');
  if (star == std::string_view::npos) return row == name ? std::optional<int>(0) : std::nullopt;
  const std::string_view head = row.substr(0, star), tail = row.substr(star + 1);
  if (!name.starts_with(head) || !name.ends_with(tail) || name.size() <= head.size() + tail.size()) return std::nullopt;
  const std::string_view digits = name.substr(head.size(), name.size() - head.size() - tail.size());
  int number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool plain =
      error == std::errc{} && end == digits.data() + digits.size() && (digits.size() == 1 || digits.front() != '0');
  return plain && number >= first && number <= last ? std::optional<int>(number) : std::nullopt;
}

double analog_value(bool volts, double ratio) {
  ratio = std::isfinite(ratio) ? std::clamp(ratio, 0.0, 1.0) : 0.0;
  return volts ? 10 * ratio : 4 + 16 * ratio;
}

}  // namespace

std::string_view name_of(RtdeType type) {
  switch (type) {
    case T::kBool:
      return "BOOL";
    case T::kUint8:
      return "UINT8";
    case T::kUint32:
      return "UINT32";
    case T::kUint64:
      return "UINT64";
    case T::kInt32:
      return "INT32";
    case T::kDouble:
      return "DOUBLE";
    case T::kVector3d:
      return "VECTOR3D";
    case T::kVector6d:
      return "VECTOR6D";
    case T::kVector6Int32:
      return "VECTOR6INT32";
  }
  return "";
}

std::size_t bytes_of(RtdeType type) {
  switch (type) {
    case T::kBool:
    case T::kUint8:
      return 1;
    case T::kUint32:
    case T::kInt32:
      return 4;
    case T::kUint64:
    case T::kDouble:
      return 8;
    case T::kVector3d:
    case T::kVector6Int32:
      return 24;
    case T::kVector6d:
      return 48;
  }
  return 0;
}

RtdeOutput find_rtde_output(std::string_view name, const ControllerIdentity& identity) {
  for (const OutputRow& row : kOutputs) {
    const std::optional<int> number = match(row.name, row.first, row.last, name);
    if (number && has(row.since, identity)) return {row.type, *number, row.write};
  }
  return {};
}

RtdeInput find_rtde_input(std::string_view name, const ControllerIdentity& identity) {
  int at_row = 0;
  for (const InputRow& row : kInputs) {
    const std::optional<int> number = match(row.name, row.first, row.last, name);
    if (number && has(row.since, identity)) return {row.type, *number, at_row, row.read};
    ++at_row;
  }
  return {};
}

void apply_rtde_inputs(const RtdeInputs& inputs, Controller& controller) {
  if (inputs.speed_slider_mask != 0) controller.set_speed_slider(inputs.speed_slider_fraction);
  InputsOutputs& io = controller.io();
  const auto set = [&io](std::uint8_t mask, std::uint8_t values, int first, int count) {
    for (int bit = 0; bit < count; ++bit) {
      if ((mask >> bit & 1) != 0) io.set_output(first + bit, (values >> bit & 1) != 0);
    }
  };
  set(inputs.standard_mask, inputs.standard, 0, 8);
  set(inputs.configurable_mask, inputs.configurable, kConfigurableBit, 8);
  set(inputs.tool_mask, inputs.tool, kToolBit, 2);
  for (int i = 0; i < 2; ++i) {
    if ((inputs.analog_mask >> i & 1) == 0) continue;
    const bool volts = (inputs.analog_type >> i & 1) != 0;
    const std::uint32_t type_bit = 4U << i;
    io.analog_types = volts ? io.analog_types | type_bit : io.analog_types & ~type_bit;
    io.analog_outputs[at(i)] = analog_value(volts, inputs.analog[at(i)]);
  }
}

}  // namespace firstlook::sim::ur
