/// What URScript's operators do with values.
#pragma once

#include <expected>
#include <span>
#include <string>

#include "hal/sim/ur_controller/script/code.hpp"

namespace firstlook::sim::ur::script {

/// The error is its text, as a runtime exception says it.
using Computed = std::expected<Value, std::string>;

/// Numbers by each other; lists with lists of their length and with numbers, element by element; a matrix times a
/// matrix or a list as linear algebra has it.
[[nodiscard]] Computed binary(BinaryOp op, const Value& a, const Value& b);
[[nodiscard]] Computed negate(const Value& value);
/// Of a list of rows with as many numbers each; 0 for what is no matrix.
[[nodiscard]] std::size_t matrix_columns(const Value& value);
[[nodiscard]] Value with_capacity(List list, std::uint32_t capacity);
/// An int from 0 to below `size`.
[[nodiscard]] std::expected<std::size_t, std::string> index_within(const Value& index, std::size_t size);
/// The element at that path; an index is an int, or the name of a struct's member.
[[nodiscard]] Computed element_of(const Value& container, std::span<const Value> path);
/// `container` with the element at that path replaced.
[[nodiscard]] Computed with_element(Value container, std::span<const Value> path, const Value& element);
/// What a variable holds that held `before` and is given `value`: a list keeps its capacity, as far as the new elements
/// fit into it, and takes the members of a struct that are of its elements' type.
[[nodiscard]] Value assigned(const Value& before, Value value);

}  // namespace firstlook::sim::ur::script
