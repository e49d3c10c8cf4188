/// URScript as tokens.
#pragma once

#include <cstdint>
#include <expected>
#include <string>
#include <string_view>
#include <vector>

namespace firstlook::sim::ur::script {

/// What is wrong with a script, in the words of a UR controller, and where (from 1).
struct ScriptError {
  int line = 0, column = 0;
  std::string text;
};

struct Token {
  enum class Kind : std::uint8_t { kName, kInteger, kFloat, kText, kSymbol, kLineEnd, kEnd };
  Kind kind = Kind::kEnd;
  std::string text;  ///< of a string without its quotes
  int line = 0, column = 0;

  [[nodiscard]] bool is(std::string_view symbol) const {
    return (kind == Kind::kSymbol || kind == Kind::kName) && text == symbol;
  }
};

/// A word of the language itself.
[[nodiscard]] bool is_keyword(std::string_view word);

/// Line ends within brackets and after operators are left out, and comments; several line ends are one. The last token
/// is kEnd.
[[nodiscard]] std::expected<std::vector<Token>, ScriptError> tokenize(std::string_view script);

/// "syntax_error_on_line:4:   the line:"
[[nodiscard]] ScriptError syntax_error(std::string_view script, int line, int column);

}  // namespace firstlook::sim::ur::script
