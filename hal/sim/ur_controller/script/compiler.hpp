/// From URScript to code, in one pass over its tokens.
#pragma once

#include <expected>
#include <string_view>

#include "hal/sim/ur_controller/script/code.hpp"
#include "hal/sim/ur_controller/script/lexer.hpp"

namespace firstlook::sim::ur::script {

/// A program: one `def` or `sec` with everything in it, or statements without one. What is wrong is said as a UR
/// controller does: "syntax_error_on_line:...", "compile_error_name_not_found:...".
[[nodiscard]] std::expected<Code, ScriptError> compile(std::string_view script);

}  // namespace firstlook::sim::ur::script
