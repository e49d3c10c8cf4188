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

/// Where code can be taken back to: without what was compiled into it since.
struct CodeMark {
  std::size_t functions = 0, constants = 0, globals = 0;
  std::map<std::string, int> function_numbers;
};
[[nodiscard]] CodeMark mark_of(const Code& code);
void take_back(Code& code, const CodeMark& mark);

/// Adds one line of statements to the code of a program that is in interpreter mode, as a function to be run in the
/// frame of `scope`, the function that called interpreter_mode(): it sees that one's variables and the program's, and
/// what the lines before it defined. Variables that are new are the code's last globals. What does not compile leaves
/// the code as it was.
struct StatementLine {
  int function = 0;
  bool clears = false;  ///< calls clear_interpreter()
};
[[nodiscard]] std::expected<StatementLine, ScriptError> compile_statements(std::string_view line, Code& code,
                                                                           int scope);

}  // namespace firstlook::sim::ur::script
