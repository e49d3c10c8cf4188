#include "hal/sim/ur_controller/script/value.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace firstlook::sim::ur::script {
namespace {

void append(std::string& text, const Value& value) {
  if (text.size() > kTextBytesMax) return;
  if (const bool* b = value.as<bool>()) {
    text += *b ? "True" : "False";
  } else if (const auto* i = value.as<std::int64_t>()) {
    text += std::to_string(*i);
  } else if (const auto* d = value.as<double>()) {
    text += fmt::format("{:.6g}", *d);
  } else if (const auto* s = value.as<std::string>()) {
    text += *s;
  } else if (const auto* pose = value.as<PoseValue>()) {
    text += 'p';
    append(text, Value(list_of(pose->pose)));
  } else if (const auto* list = value.as<List>()) {
    text += '[';
    for (const Value& element : *list) {
      if (&element != &list->front()) text += ", ";
      append(text, element);
    }
    text += ']';
  } else if (const auto* members = value.as<StructValue>()) {
    text += "struct(";
    for (std::size_t k = 0; k < members->names.size() && text.size() <= kTextBytesMax; ++k) {
      text += (k > 0 ? ", " : "") + members->names[k] + " = ";
      append(text, members->values[k]);
    }
    text += ')';
  } else {
    text += value.empty() ? "None" : type_name(value);
  }
}

/// What a text weighs beside its value's 1.
std::uint32_t weight_of(std::string_view text) { return static_cast<std::uint32_t>(text.size() / 32); }

/// Weight and depth of a value with these in it.
void contain(Value& value, const List& elements) {
  std::uint64_t weight = value.weight;
  int depth = 0;
  for (const Value& element : elements) {
    weight += element.weight;
    depth = std::max<int>(depth, element.depth);
  }
  value.weight = static_cast<std::uint32_t>(std::min<std::uint64_t>(weight, UINT32_MAX / 2));
  value.depth = static_cast<std::uint16_t>(std::min(depth + 1, UINT16_MAX / 2));
}

/// As it is now, in all that it contains.
void measure_depth(Value& value) {
  List* const elements = value.as<List>() != nullptr          ? value.as<List>()
                         : value.as<StructValue>() != nullptr ? &value.as<StructValue>()->values
                                                              : nullptr;
  if (elements == nullptr) return;
  value.depth = 1;
  for (Value& element : *elements) {
    measure_depth(element);
    value.depth = std::max<std::uint16_t>(value.depth, static_cast<std::uint16_t>(element.depth + 1));
  }
}

bool int_or_thread(const Value& value) {
  return value.as<std::int64_t>() != nullptr || value.as<ThreadHandle>() != nullptr;
}

}  // namespace

Value::Value(std::string value) : content(std::move(value)), weight(1 + weight_of(std::get<std::string>(content))) {}

Value::Value(List value) : content(std::move(value)) {
  const List& list = std::get<List>(content);
  contain(*this, list);
  capacity = static_cast<std::uint16_t>(std::min<std::size_t>(list.size(), UINT16_MAX));
}

Value::Value(StructValue value) : content(std::move(value)) {
  const auto& members = std::get<StructValue>(content);
  for (const std::string& name : members.names) weight += 1 + weight_of(name);
  contain(*this, members.values);
}

Value with_capacity(List list, std::size_t capacity) {
  Value value(std::move(list));
  value.capacity = std::max(value.capacity, static_cast<std::uint16_t>(std::min<std::size_t>(capacity, UINT16_MAX)));
  return value;
}

std::string_view Value::excess() {
  if (weight > kWeightMax) return "Out of memory: a list is too large";
  if (depth > kDepthMax) measure_depth(*this);  // what made it deep may be gone
  return depth > kDepthMax ? "Out of memory: lists are nested too deep" : "";
}

double Value::number() const {
  if (const auto* i = as<std::int64_t>()) return static_cast<double>(*i);
  const auto* d = as<double>();
  return d != nullptr ? *d : 0;
}

List list_of(const Vector6& values) {
  List list;
  for (const double value : values) list.emplace_back(value);
  return list;
}

std::string text_of(const Value& value) {
  std::string text;
  append(text, value);
  return text;
}

std::string_view type_name(const Value& value) {
  constexpr std::string_view kNames[] = {"none", "bool", "int",    "float", "string",
                                         "list", "pose", "thread", "rpc",   "struct"};
  return kNames[value.content.index()];
}

bool alike(const Value& a, const Value& b) {
  const auto* members = a.as<StructValue>();
  const auto* others = b.as<StructValue>();
  if (members != nullptr && others != nullptr) {
    return members->names == others->names && std::ranges::equal(members->values, others->values, alike);
  }
  return (a.is_number() && b.is_number()) || (int_or_thread(a) && int_or_thread(b)) ||
         a.content.index() == b.content.index();
}

bool equal(const Value& a, const Value& b) {
  if (a.is_number() && b.is_number()) return a.number() == b.number();
  if (a.content.index() != b.content.index()) return false;
  if (const bool* flag = a.as<bool>()) return *flag == *b.as<bool>();
  if (const auto* text = a.as<std::string>()) return *text == *b.as<std::string>();
  if (const auto* pose = a.as<PoseValue>()) return pose->pose == b.as<PoseValue>()->pose;
  if (const auto* thread = a.as<ThreadHandle>()) return thread->number == b.as<ThreadHandle>()->number;
  if (const auto* rpc = a.as<RpcHandle>()) return rpc->url == b.as<RpcHandle>()->url;
  if (const auto* members = a.as<StructValue>()) {
    const auto& others = *b.as<StructValue>();
    return members->names == others.names && std::ranges::equal(members->values, others.values, equal);
  }
  if (const auto* list = a.as<List>()) return std::ranges::equal(*list, *b.as<List>(), equal);
  return true;
}

}  // namespace firstlook::sim::ur::script
