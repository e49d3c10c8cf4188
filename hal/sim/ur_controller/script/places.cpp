#include "hal/sim/ur_controller/script/places.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "hal/sim/ur_controller/script/list_methods.hpp"

namespace firstlook::sim::ur::script {
namespace {

using Path = std::span<const Value>;

/// Where in the container the index leads. Error: nowhere.
std::expected<std::size_t, std::string> place(const Value& container, const Value& index) {
  const StructValue* members = container.as<StructValue>();
  const auto* name = index.as<std::string>();
  if (members == nullptr && name != nullptr) {
    return std::unexpected(fmt::format("Type error: {} has no members", type_name(container)));
  }
  if (members != nullptr && name != nullptr) {
    const auto found = std::ranges::find(members->names, *name);
    if (found == members->names.end()) return std::unexpected(fmt::format("The struct has no member {}", *name));
    return static_cast<std::size_t>(found - members->names.begin());
  }
  if (members != nullptr) return index_within(index, members->values.size());
  if (const List* list = container.as<List>()) return index_within(index, list->size());
  if (const PoseValue* pose = container.as<PoseValue>()) return index_within(index, pose->pose.size());
  return std::unexpected(fmt::format("Type error: {} has no elements", type_name(container)));
}

/// Does `change` to what stands there. What contains it weighs as much more as that does.
/// @param member  `container` is a struct's
template <typename Change>
Computed change_at(Value& container, Path path, const Change& change, bool member = false) {
  if (path.empty()) return change(container, member);
  const auto at = place(container, path[0]);
  if (!at) return std::unexpected(at.error());
  if (PoseValue* pose = container.as<PoseValue>()) {
    Value number = pose->pose[*at];
    Computed answer = change_at(number, path.subspan(1), change);
    if (answer && !number.is_number()) return std::unexpected("Type error: a pose has six numbers");
    if (answer) pose->pose[*at] = number.number();
    return answer;
  }
  List* list = container.as<List>();
  Value& inner = list != nullptr ? (*list)[*at] : container.as<StructValue>()->values[*at];
  const std::uint32_t weight_before = inner.weight;
  Computed answer = change_at(inner, path.subspan(1), change, list == nullptr);
  container.weight += inner.weight - weight_before;
  container.depth = std::max<std::uint16_t>(container.depth, static_cast<std::uint16_t>(inner.depth + 1));
  return answer;
}

}  // namespace

std::expected<std::size_t, std::string> index_within(const Value& index, std::size_t size) {
  const auto* i = index.as<std::int64_t>();
  if (i == nullptr) return std::unexpected(fmt::format("Type error: index is {}", type_name(index)));
  if (*i < 0 || static_cast<std::size_t>(*i) >= size) {
    return std::unexpected(fmt::format("Index out of bounds: {} of {}", *i, size));
  }
  return static_cast<std::size_t>(*i);
}

const Value* find_element(const Value& container, Path path) {
  const Value* at = &container;
  for (const Value& index : path) {
    const auto found = place(*at, index);
    if (!found || at->as<PoseValue>() != nullptr) return nullptr;
    const List* list = at->as<List>();
    at = list != nullptr ? &(*list)[*found] : &at->as<StructValue>()->values[*found];
  }
  return at;
}

Computed element_of(const Value& container, Path path) {
  if (path.empty()) return container;
  const Value* holder = find_element(container, path.first(path.size() - 1));
  if (holder == nullptr) {  // why, is found on the way there
    Computed inner = element_of(container, path.first(path.size() - 1));
    return inner ? element_of(*inner, path.last(1)) : inner;
  }
  const auto at = place(*holder, path.back());
  if (!at) return std::unexpected(at.error());
  if (const PoseValue* pose = holder->as<PoseValue>()) return Value(pose->pose[*at]);
  return *find_element(*holder, path.last(1));
}

Computed set_element(Value& container, Path path, const Value& element) {
  return change_at(container, path, [&](Value& spot, bool member) -> Computed {
    Value next = assigned(spot, element);
    if (member && !spot.empty() && !alike(spot, next)) {
      const bool structs = spot.as<StructValue>() != nullptr && next.as<StructValue>() != nullptr;
      return std::unexpected(fmt::format("Type error: member {} is {}, not {}", text_of(path.back()), type_name(spot),
                                         structs ? "one with other members" : type_name(next)));
    }
    spot = std::move(next);
    return Value();
  });
}

Computed call_at(Value& container, Path path, std::string_view method, std::span<const Value> arguments) {
  return change_at(container, path, [&](Value& list, bool) { return call_list_method(list, method, arguments); });
}

Value assigned(const Value& before, Value value) {
  const List* list = before.as<List>();
  if (list == nullptr || before.capacity == 0) return value;
  StructValue* members = value.as<StructValue>();
  if (members != nullptr && !members->values.empty()) {
    const Value& kind = list->empty() ? members->values.front() : list->front();
    if (!std::ranges::all_of(members->values, [&](const Value& v) { return alike(v, kind); })) return value;
    value = Value(std::move(members->values));
  }
  if (value.as<List>() != nullptr && value.as<List>()->size() <= before.capacity) value.capacity = before.capacity;
  return value;
}

}  // namespace firstlook::sim::ur::script
