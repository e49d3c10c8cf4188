/// The tokens of a script as a compiler reads them, one after the other, and the first thing that is wrong with them.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/sim/ur_controller/script/lexer.hpp"

namespace firstlook::sim::ur::script {

class TokenCursor {
 public:
  /// @param script  where the tokens come from; must outlive the cursor
  TokenCursor(std::string_view script, std::vector<Token> tokens) : script_(script), tokens_(std::move(tokens)) {}

  [[nodiscard]] const std::vector<Token>& all() const { return tokens_; }
  [[nodiscard]] std::size_t position() const { return at_; }
  [[nodiscard]] const Token& now() const { return tokens_[at_]; }
  [[nodiscard]] const Token& ahead(std::size_t count = 1) const {
    return tokens_[std::min(at_ + count, tokens_.size() - 1)];
  }
  [[nodiscard]] bool at_end() const { return now().kind == Token::Kind::kEnd; }
  [[nodiscard]] bool ends_block() const { return now().is("end") || now().is("elif") || now().is("else"); }

  void advance() {
    if (at_ + 1 < tokens_.size()) ++at_;
  }
  /// Past the symbol or word, if it is next.
  bool accept(std::string_view symbol);
  void expect(std::string_view symbol) {
    if (!accept(symbol)) fail_here();
  }
  std::string expect_name();
  /// Of a struct: a name that is no keyword.
  std::string expect_member();
  /// More than one statement may stand on a line.
  void end_statement();
  void skip_line_ends() {
    while (now().kind == Token::Kind::kLineEnd) advance();
  }

  /// Into a block or an expression; too deep is an error.
  void enter();
  void leave() { --nesting_; }

  /// The first error counts. Nothing more is read then: every loop over tokens ends.
  void fail(ScriptError error);
  void fail_here() { fail_syntax(now()); }
  void fail_syntax(const Token& at) { fail(syntax_error(script_, at.line, at.column)); }
  [[nodiscard]] bool failed() const { return error_.has_value(); }
  [[nodiscard]] const std::optional<ScriptError>& error() const { return error_; }

 private:
  std::string_view script_;
  std::vector<Token> tokens_;
  std::size_t at_ = 0;
  int nesting_ = 0;
  std::optional<ScriptError> error_;
};

}  // namespace firstlook::sim::ur::script
