#include "hal/sim/ur_controller/script/builtins.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace firstlook::sim::ur::script {
namespace {

/// Names are found in a sorted copy of all tables, made once.
const std::vector<Builtin>& all() {
  static const std::vector<Builtin> builtins = [] {
    std::vector<Builtin> rows;
    for (const auto table :
         {math_builtins(), text_builtins(), motion_builtins(), robot_builtins(), io_builtins(), socket_builtins(),
          interpreter_builtins(), pendant_builtins(), rpc_builtins(), object_builtins()}) {
      rows.insert(rows.end(), table.begin(), table.end());
    }
    std::ranges::stable_sort(rows, {}, &Builtin::name);
    return rows;
  }();
  return builtins;
}

/// 1, 0.5, True, "text" or [].
Value literal(std::string_view text) {
  if (text == "True" || text == "False") return text == "True";
  if (text == "[]") return List{};
  if (text.starts_with('"')) return std::string(text.substr(1, text.size() - 2));
  std::int64_t integer = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), integer);
  if (error == std::errc{} && end == text.data() + text.size()) return integer;
  double real = 0;
  std::from_chars(text.data(), text.data() + text.size(), real);
  return real;
}

}  // namespace

int find_builtin(std::string_view name) {
  const auto found = std::ranges::lower_bound(all(), name, {}, &Builtin::name);
  return found != all().end() && found->name == name ? static_cast<int>(found - all().begin()) : -1;
}

const Builtin& builtin(int number) { return all()[static_cast<std::size_t>(number)]; }

std::vector<Parameter> parameters_of(int number) {
  std::vector<Parameter> parameters;
  std::string_view rest = builtin(number).parameters;
  while (!rest.empty()) {
    const std::size_t comma = rest.find(',');
    const std::string_view one = rest.substr(0, comma);
    const std::size_t equals = one.find('=');
    Parameter parameter;
    parameter.name = one.substr(0, equals);
    parameter.has_default = equals != std::string_view::npos;
    if (parameter.has_default) parameter.default_value = literal(one.substr(equals + 1));
    parameters.push_back(std::move(parameter));
    rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
  }
  return parameters;
}

void Call::answer_or_fail(Computed computed) {
  if (!computed) return fail(computed.error());
  answer(std::move(*computed));
}

void Call::fail_excess(Value& value) {
  if (const auto excess = value.excess(); !excess.empty()) fail(std::string(excess));
}

void Call::fail_type(std::size_t i, std::string_view wanted) {
  fail(fmt::format("Type error: argument {} is {}, not {}", i + 1, type_name(arguments_[i]), wanted));
}

double Call::number(std::size_t i) {
  if (!arguments_[i].is_number()) fail_type(i, "a number");
  const double value = arguments_[i].number();
  if (!std::isfinite(value)) fail(fmt::format("Argument {} is not finite", i + 1));
  return value;
}

std::int64_t Call::integer(std::size_t i) {
  if (const auto* integer = arguments_[i].as<std::int64_t>()) return *integer;
  // Floats that are whole do as well: registers are often computed.
  const auto* real = arguments_[i].as<double>();
  if (real != nullptr && std::abs(*real) < 2e9 && *real == std::floor(*real)) return static_cast<std::int64_t>(*real);
  fail_type(i, "an int");
  return 0;
}

int Call::integer(std::size_t i, int low, int high) {
  const std::int64_t value = integer(i);
  if (value >= low && value <= high) return static_cast<int>(value);
  fail(fmt::format("Argument {} is {}, not within {} to {}", i + 1, value, low, high));
  return low;
}

bool Call::flag(std::size_t i) {
  if (const bool* flag = arguments_[i].as<bool>()) return *flag;
  fail_type(i, "a bool");
  return false;
}

std::string Call::text(std::size_t i) {
  if (const auto* text = arguments_[i].as<std::string>()) return *text;
  fail_type(i, "a string");
  return {};
}

Vector6 Call::six(std::size_t i) {
  if (const PoseValue* pose = arguments_[i].as<PoseValue>()) return pose->pose;
  const List* list = arguments_[i].as<List>();
  Vector6 values{};
  if (list == nullptr || list->size() != values.size()) {
    fail_type(i, "six numbers");
    return values;
  }
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!(*list)[k].is_number() || !std::isfinite((*list)[k].number())) fail_type(i, "six numbers");
    values[k] = (*list)[k].number();
  }
  return values;
}

Vector3 Call::three(std::size_t i) {
  const List* list = arguments_[i].as<List>();
  Vector3 values{};
  if (list == nullptr || list->size() != values.size()) {
    fail_type(i, "three numbers");
    return values;
  }
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!(*list)[k].is_number()) fail_type(i, "three numbers");
    values[k] = (*list)[k].number();
  }
  return values;
}

JointVector Call::joints(std::size_t i) {
  const Vector6 values = six(i);
  JointVector q = JointVector::zero(6);
  for (int j = 0; j < 6; ++j) q[j] = values[static_cast<std::size_t>(j)];
  return q;
}

bool Call::waited(double seconds) {
  CallState& call = state();
  if (call.first) call.until_s = machine_.now_s() + seconds;
  // Half a cycle of tolerance, since sums of cycles are not exact; but any time takes a cycle.
  const bool begins = call.first && seconds > 0;
  if (!begins && machine_.now_s() >= call.until_s - machine_.cycle_s() / 2) return true;
  wait();
  return false;
}

}  // namespace firstlook::sim::ur::script
