/// What a script defines, found before it is compiled: functions may be called above their definition.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hal/sim/ur_controller/script/lexer.hpp"

namespace firstlook::sim::ur::script {

struct Names {
  std::map<std::string, std::vector<std::string>> functions;  ///< and threads, with the names of their parameters
  std::vector<Token> declared;                                ///< `global`, anywhere
  std::vector<std::string> assigned;  ///< by the body of the program itself: they belong to all its functions
};

/// Of a whole script: where it begins with a `def` or `sec`, that is the program.
[[nodiscard]] Names find_program_names(const std::vector<Token>& tokens);
/// Of statements for a program that runs.
[[nodiscard]] Names find_statement_names(const std::vector<Token>& tokens);

/// Beyond a name with its indices and members, a[2].b: the token that follows.
[[nodiscard]] std::size_t end_of_place(const std::vector<Token>& tokens, std::size_t i);
/// "a[2].append(": a method that changes the list that stands there, and with it the variable.
[[nodiscard]] bool changes_list(const std::vector<Token>& tokens, std::size_t i);
/// An assignment begins at this token: a name, perhaps indices and members, and "=".
[[nodiscard]] bool assigns(const std::vector<Token>& tokens, std::size_t i);
/// "digital_out[2] = ...": an output by its old name, not a list of the program's.
[[nodiscard]] bool sets_signal(const std::vector<Token>& tokens, std::size_t i);

}  // namespace firstlook::sim::ur::script
