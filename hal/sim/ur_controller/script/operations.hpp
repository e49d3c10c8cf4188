/// What URScript's operators do with values.
#pragma once

#include <expected>
#include <span>
#include <string>

#include "hal/sim/ur_controller/script/code.hpp"

namespace firstlook::sim::ur::script {

/// The error is its text, as a runtime exception says it.
using Computed = std::expected<Value, std::string>;

[[nodiscard]] Computed binary(BinaryOp op, const Value& a, const Value& b);
[[nodiscard]] Computed negate(const Value& value);
[[nodiscard]] Computed element_of(const Value& container, const Value& index);
/// `container` with the element at that path replaced.
[[nodiscard]] Computed with_element(Value container, std::span<const Value> path, const Value& element);

}  // namespace firstlook::sim::ur::script
