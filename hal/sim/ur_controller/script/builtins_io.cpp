// Digital and analog inputs and outputs, registers, flags.
#include <cmath>

#include "hal/sim/ur_controller/script/builtins.hpp"

namespace firstlook::sim::ur::script {
namespace {

/// Where in the digital bits a group of signals is.
struct Standard {
  static constexpr int kFirst = 0, kCount = 8;
};
struct Configurable {
  static constexpr int kFirst = kConfigurableBit, kCount = 8;
};
struct Tool {
  static constexpr int kFirst = kToolBit, kCount = 2;
};

template <typename Group>
void set_output(Call& c) {
  const int bit = c.integer(0, 0, Group::kCount - 1);
  const bool value = c.flag(1);
  if (c.ok()) c.controller().io().set_output(Group::kFirst + bit, value);
}
template <typename Group>
void get_output(Call& c) {
  c.answer(c.robot().io.output(Group::kFirst + c.integer(0, 0, Group::kCount - 1)));
}
template <typename Group>
void get_input(Call& c) {
  const int bit = Group::kFirst + c.integer(0, 0, Group::kCount - 1);
  c.answer((c.robot().io.digital_inputs >> bit & 1) != 0);
}

/// The old names: 0 to 7 standard, 8 and 9 the tool.
int old_bit(Call& c) {
  const int bit = c.integer(0, 0, 9);
  return bit < 8 ? bit : kToolBit + bit - 8;
}
void set_digital_out(Call& c) {
  const int bit = old_bit(c);
  const bool value = c.flag(1);
  if (c.ok()) c.controller().io().set_output(bit, value);
}
void get_digital_out(Call& c) { c.answer(c.robot().io.output(old_bit(c))); }
void get_digital_in(Call& c) { c.answer((c.robot().io.digital_inputs >> old_bit(c) & 1) != 0); }

std::size_t port(Call& c) { return static_cast<std::size_t>(c.integer(0, 0, 1)); }

/// `f` is the share of the range of the output's domain.
void set_analog_out(Call& c) {
  const std::size_t i = port(c);
  const double share = c.number(1);
  if (share < 0 || share > 1) c.fail("An analog output takes 0 to 1");
  if (!c.ok()) return;
  const bool volts = (c.robot().io.analog_types >> (2 + i) & 1) != 0;
  c.controller().io().analog_outputs[i] = volts ? 10 * share : 4 + 16 * share;
}
void get_analog_out(Call& c) {
  const std::size_t i = port(c);
  const double value = c.robot().io.analog_outputs[i];
  const bool volts = (c.robot().io.analog_types >> (2 + i) & 1) != 0;
  c.answer(volts ? value / 10 : std::max(0.0, (value - 4) / 16));
}
void get_analog_in(Call& c) { c.answer(c.robot().io.analog_inputs[port(c)]); }
void get_tool_analog_in(Call& c) { c.answer(c.robot().io.tool_analog_inputs[port(c)]); }

/// 0 is current, 1 voltage: a bit for each port, from `first_bit` on.
void set_domain(Call& c, std::uint32_t& types, std::size_t first_bit) {
  const std::uint32_t bit = 1U << (first_bit + port(c));
  const int domain = c.integer(1, 0, 1);
  if (c.ok()) types = domain == 1 ? types | bit : types & ~bit;
}
void set_input_domain(Call& c) { set_domain(c, c.controller().io().analog_types, 0); }
void set_output_domain(Call& c) { set_domain(c, c.controller().io().analog_types, 2); }
void set_tool_input_domain(Call& c) { set_domain(c, c.controller().io().tool_analog_types, 0); }

void set_tool_voltage(Call& c) {
  const int volts = c.integer(0, 0, 24);
  if (volts != 0 && volts != 12 && volts != 24) c.fail("The tool takes 0, 12 or 24 V");
  if (c.ok()) c.controller().io().tool_voltage_v = volts;
}

void set_flag(Call& c) {
  const auto i = static_cast<std::size_t>(c.integer(0, 0, 31));
  const bool value = c.flag(1);
  if (c.ok()) c.controller().io().flags[i] = value;
}
void get_flag(Call& c) { c.answer(bool{c.robot().io.flags[static_cast<std::size_t>(c.integer(0, 0, 31))]}); }

std::size_t register_number(Call& c) { return static_cast<std::size_t>(c.integer(0, 0, kRegisters - 1)); }
std::size_t bit_number(Call& c) { return static_cast<std::size_t>(c.integer(0, 0, 127)); }

void write_bit(Call& c) {
  const std::size_t i = bit_number(c);
  const bool value = c.flag(1);
  if (c.ok()) c.controller().outputs().set_bit(i, value);
}
void write_integer(Call& c) {
  const std::size_t i = register_number(c);
  const std::int64_t value = c.integer(1);
  if (c.ok()) c.controller().outputs().integers[i] = static_cast<std::int32_t>(value);
}
void write_float(Call& c) {
  const std::size_t i = register_number(c);
  const double value = c.number(1);
  if (c.ok()) c.controller().outputs().doubles[i] = value;
}

/// What an installation sets up and this robot has no use for.
void nothing(Call&) {}

constexpr Builtin kTable[] = {
    {"get_analog_in", "n", get_analog_in},
    {"get_analog_out", "n", get_analog_out},
    {"get_configurable_digital_in", "n", get_input<Configurable>},
    {"get_configurable_digital_out", "n", get_output<Configurable>},
    {"get_digital_in", "n", get_digital_in},
    {"get_digital_out", "n", get_digital_out},
    {"get_flag", "n", get_flag},
    {"get_standard_analog_in", "n", get_analog_in},
    {"get_standard_analog_out", "n", get_analog_out},
    {"get_standard_digital_in", "n", get_input<Standard>},
    {"get_standard_digital_out", "n", get_output<Standard>},
    {"get_tool_analog_in", "n", get_tool_analog_in},
    {"get_tool_digital_in", "n", get_input<Tool>},
    {"get_tool_digital_out", "n", get_output<Tool>},
    {"read_input_boolean_register", "address", [](Call& c) { c.answer(c.robot().inputs.bit(bit_number(c))); }},
    {"read_input_float_register", "address", [](Call& c) { c.answer(c.robot().inputs.doubles[register_number(c)]); }},
    {"read_input_integer_register", "address",
     [](Call& c) { c.answer(std::int64_t{c.robot().inputs.integers[register_number(c)]}); }},
    {"read_output_boolean_register", "address", [](Call& c) { c.answer(c.robot().outputs.bit(bit_number(c))); }},
    {"read_output_float_register", "address", [](Call& c) { c.answer(c.robot().outputs.doubles[register_number(c)]); }},
    {"read_output_integer_register", "address",
     [](Call& c) { c.answer(std::int64_t{c.robot().outputs.integers[register_number(c)]}); }},
    {"set_analog_inputrange", "port,range", nothing},
    {"set_analog_out", "n,f", set_analog_out},
    {"set_analog_outputdomain", "port,domain", set_output_domain},
    {"set_configurable_digital_input_action", "port,action", nothing},
    {"set_configurable_digital_out", "n,b", set_output<Configurable>},
    {"set_digital_out", "n,b", set_digital_out},
    {"set_flag", "n,b", set_flag},
    {"set_gp_boolean_input_action", "port,action", nothing},
    {"set_input_actions_to_default", "", nothing},
    {"set_runstate_configurable_digital_output_to_value", "outputId,state", nothing},
    {"set_runstate_gp_boolean_output_to_value", "outputId,state", nothing},
    {"set_runstate_outputs", "outputs", nothing},
    {"set_runstate_standard_analog_output_to_value", "outputId,state", nothing},
    {"set_runstate_standard_digital_output_to_value", "outputId,state", nothing},
    {"set_runstate_tool_digital_output_to_value", "outputId,state", nothing},
    {"set_standard_analog_input_domain", "port,domain", set_input_domain},
    {"set_standard_analog_out", "n,f", set_analog_out},
    {"set_standard_digital_input_action", "port,action", nothing},
    {"set_standard_digital_out", "n,b", set_output<Standard>},
    {"set_tool_analog_input_domain", "port,domain", set_tool_input_domain},
    {"set_tool_communication", "enabled,baud_rate,parity,stop_bits,rx_idle_chars=1.5,tx_idle_chars=3.5", nothing},
    {"set_tool_digital_input_action", "port,action", nothing},
    {"set_tool_digital_out", "n,b", set_output<Tool>},
    {"set_tool_digital_output_mode", "n,mode", nothing},
    {"set_tool_output_mode", "mode", nothing},
    {"set_tool_voltage", "voltage", set_tool_voltage},
    {"write_output_boolean_register", "address,value", write_bit},
    {"write_output_float_register", "address,value", write_float},
    {"write_output_integer_register", "address,value", write_integer},
};

}  // namespace

std::span<const Builtin> io_builtins() { return kTable; }

}  // namespace firstlook::sim::ur::script
