#include "hal/sim/ur_controller/rtde_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace firstlook::sim::ur {
namespace {

constexpr std::size_t kHeaderBytes = 3;
constexpr std::size_t kRecipesMax = 255;  // of inputs: their number is a byte, and 0 means none
constexpr char kOutputRecipe = '\1';
constexpr double kProtocol1Frequency_hz = 125;
constexpr std::uint8_t kErrorLevel = 1;  // exception, error, warning, info

std::vector<std::string_view> split(std::string_view list) {
  std::vector<std::string_view> names;
  for (;;) {
    const std::size_t comma = list.find(',');
    std::string_view name = list.substr(0, comma);
    while (!name.empty() && name.front() == ' ') name.remove_prefix(1);
    while (!name.empty() && (name.back() == ' ' || name.back() == '\0')) name.remove_suffix(1);
    names.push_back(name);
    if (comma == std::string_view::npos) return names;
    list.remove_prefix(comma + 1);
  }
}

void add_to_list(std::string& list, std::string_view word) {
  if (!list.empty()) list.push_back(',');
  list.append(word);
}

}  // namespace

void RtdeSession::receive(std::string_view bytes) {
  received_.append(bytes);
  std::size_t at = 0;
  while (!over() && received_.size() - at >= kHeaderBytes) {
    WireReader header(std::string_view(received_).substr(at));
    const std::size_t size = header.u16();
    const std::uint8_t type = header.u8();
    if (size < kHeaderBytes) {
      send_text("a package shorter than its header: closing");
      end();
      break;
    }
    if (received_.size() - at < size) break;
    handle(type, std::string_view(received_).substr(at + kHeaderBytes, size - kHeaderBytes));
    at += size;
  }
  received_.erase(0, over() ? received_.size() : at);
}

void RtdeSession::handle(std::uint8_t type, std::string_view payload) {
  switch (type) {
    case 'V':
      return request_protocol(payload);
    case 'v':
      return send_version();
    case 'O':
      return set_up_outputs(payload);
    case 'I':
      return set_up_inputs(payload);
    case 'S':
      return start(true);
    case 'P':
      return start(false);
    case 'U':
      return take_data(payload);
    case 'M':
      return take_text(payload);
    default:
      send_text(fmt::format("unknown package type {}", type));
  }
}

void RtdeSession::send(std::uint8_t type, std::string_view payload) {
  WireWriter wire(output());
  wire.u16(static_cast<std::uint16_t>(kHeaderBytes + payload.size()));
  wire.u8(type);
  wire.text(payload);
}

void RtdeSession::send_text(std::string_view message) {
  std::string payload;
  WireWriter wire(payload);
  if (protocol_ == 1) {
    wire.u8(kErrorLevel);
    wire.text(message);
  } else {
    constexpr std::string_view kSource = "RTDE";
    message = message.substr(0, 255);
    wire.u8(static_cast<std::uint8_t>(message.size()));
    wire.text(message);
    wire.u8(static_cast<std::uint8_t>(kSource.size()));
    wire.text(kSource);
    wire.u8(kErrorLevel);
  }
  send('M', payload);
}

void RtdeSession::request_protocol(std::string_view payload) {
  WireReader wire(payload);
  const std::uint16_t wanted = wire.u16();
  const bool accepted = wire.ok() && (wanted == 1 || wanted == 2);
  if (accepted) protocol_ = wanted;
  send('V', accepted ? std::string_view("\1", 1) : std::string_view("\0", 1));
}

void RtdeSession::send_version() {
  std::string payload;
  WireWriter wire(payload);
  const SoftwareVersion& version = controller_.identity().version;
  for (const int part : {version.major, version.minor, version.bugfix, version.build}) {
    wire.u32(static_cast<std::uint32_t>(part));
  }
  send('v', payload);
}

void RtdeSession::set_up_outputs(std::string_view payload) {
  const double fastest_hz = controller_.identity().frequency_hz();
  WireReader wire(payload);
  double frequency_hz = protocol_ == 1 ? kProtocol1Frequency_hz : wire.f64();
  if (!(frequency_hz > 0) || frequency_hz > fastest_hz) frequency_hz = fastest_hz;

  OutputRecipe recipe;
  recipe.every_cycles = static_cast<std::uint64_t>(std::min(fastest_hz / frequency_hz, 1e9));
  std::string types;
  std::size_t bytes = kHeaderBytes + 1;
  bool valid = wire.ok();
  for (const std::string_view name : split(wire.rest())) {
    const RtdeOutput field = find_rtde_output(name, controller_.identity());
    add_to_list(types, field.write != nullptr ? name_of(field.type) : "NOT_FOUND");
    valid = valid && field.write != nullptr;
    if (field.write != nullptr) bytes += bytes_of(field.type);
    recipe.fields.push_back(field);
  }
  valid = valid && bytes <= UINT16_MAX;
  if (valid) output_recipe_ = std::move(recipe);
  if (protocol_ == 1) return send('O', types);
  send('O', std::string(1, valid ? kOutputRecipe : '\0') + types);
}

void RtdeSession::set_up_inputs(std::string_view payload) {
  InputRecipe recipe;
  std::string types;
  bool valid = input_recipes_.size() < kRecipesMax;
  for (const std::string_view name : split(payload)) {
    const RtdeInput field = find_rtde_input(name, controller_.identity());
    const bool found = field.read != nullptr;
    const bool usable = found && owners_.free_for({field.row, field.index}, *this);
    add_to_list(types, !found ? "NOT_FOUND" : !usable ? "IN_USE" : name_of(field.type));
    valid = valid && usable;
    recipe.push_back(field);
  }
  if (valid) {
    for (const RtdeInput& field : recipe) owners_.own({field.row, field.index}, *this);
    input_recipes_.push_back(std::move(recipe));
  }
  const char number = valid ? static_cast<char>(input_recipes_.size()) : '\0';
  send('I', std::string(1, number) + types);
}

void RtdeSession::start(bool running) {
  const bool accepted = !running || output_recipe_;
  if (accepted) running_ = running;
  send(running ? 'S' : 'P', std::string(1, accepted ? '\1' : '\0'));
}

void RtdeSession::take_data(std::string_view payload) {
  WireReader wire(payload);
  const std::size_t number = wire.u8();
  if (number == 0 || number > input_recipes_.size()) {
    return send_text(fmt::format("no input recipe {}", number));
  }
  const InputRecipe& recipe = input_recipes_[number - 1];
  std::size_t bytes = 1;
  for (const RtdeInput& field : recipe) bytes += bytes_of(field.type);
  if (payload.size() != bytes) {
    return send_text(fmt::format("input recipe {}: {} bytes instead of {}", number, payload.size(), bytes));
  }
  RtdeInputs inputs;
  for (const RtdeInput& field : recipe) {
    field.read(controller_, inputs, field.index, wire);
    controller_.watchdogs().renew({field.row, field.index}, controller_.state().control_step);
  }
  apply_rtde_inputs(inputs, controller_);
}

void RtdeSession::take_text(std::string_view payload) {
  WireReader wire(payload);
  const std::string_view message = wire.text(wire.u8());
  const std::string_view source = wire.text(wire.u8());
  if (!wire.ok()) return send_text("a text message shorter than it says");
  controller_.tell({.kind = ControllerEvent::Kind::kText, .text = fmt::format("{}: {}", source, message)});
}

void RtdeSession::on_cycle() {
  if (!running_ || !output_recipe_ || controller_.state().control_step % output_recipe_->every_cycles != 0) return;
  WireWriter wire(output());
  const std::size_t begin = wire.size();
  wire.u16(0);
  wire.u8('U');
  if (protocol_ != 1) wire.u8(static_cast<std::uint8_t>(kOutputRecipe));
  for (const RtdeOutput& field : output_recipe_->fields) field.write(controller_, field.index, wire);
  wire.patch_u16(begin, static_cast<std::uint16_t>(wire.size() - begin));
}

}  // namespace firstlook::sim::ur
