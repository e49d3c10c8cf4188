/// Elements of lists and members of structs within a value. A path leads to one: at each step an int, or the name of a
/// member.
#pragma once

#include <span>

#include "hal/sim/ur_controller/script/operations.hpp"

namespace firstlook::sim::ur::script {

/// An int from 0 to below `size`.
[[nodiscard]] std::expected<std::size_t, std::string> index_within(const Value& index, std::size_t size);

[[nodiscard]] Computed element_of(const Value& container, std::span<const Value> path);
/// Null where there is none, and for a number of a pose.
[[nodiscard]] const Value* find_element(const Value& container, std::span<const Value> path);
/// In place; the answer has no value. A member keeps its type.
[[nodiscard]] Computed set_element(Value& container, std::span<const Value> path, const Value& element);
/// Calls a method of the list that stands there, which may change it.
[[nodiscard]] Computed call_at(Value& container, std::span<const Value> path, std::string_view method,
                               std::span<const Value> arguments);

/// What a variable holds that held `before` and is given `value`: a list keeps its capacity, as far as the new elements
/// fit into it, and takes the members of a struct that are of its elements' type.
[[nodiscard]] Value assigned(const Value& before, Value value);

}  // namespace firstlook::sim::ur::script
