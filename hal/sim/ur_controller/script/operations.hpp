/// What URScript's operators do with values.
#pragma once

#include <expected>
#include <string>

#include "hal/sim/ur_controller/script/code.hpp"

namespace firstlook::sim::ur::script {

/// The error is its text, as a runtime exception says it.
using Computed = std::expected<Value, std::string>;

/// Numbers by each other; lists with lists of their length and with numbers, element by element; a matrix times a
/// matrix or a list as linear algebra has it.
[[nodiscard]] Computed binary(BinaryOp op, const Value& a, const Value& b);
[[nodiscard]] Computed negate(const Value& value);
}  // namespace firstlook::sim::ur::script
