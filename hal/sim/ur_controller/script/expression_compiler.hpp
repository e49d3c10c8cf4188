/// URScript's expressions, from tokens to instructions that leave a value on the stack.
#pragma once

#include <vector>

#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/script/code_writer.hpp"
#include "hal/sim/ur_controller/script/token_cursor.hpp"

namespace firstlook::sim::ur::script {

class ExpressionCompiler {
 public:
  /// Both must outlive it.
  ExpressionCompiler(TokenCursor& tokens, CodeWriter& writer) : tokens_(tokens), writer_(writer) {}

  void expression();
  /// Indices and members behind a variable, a[2].b: their values; how many.
  int place();
  /// "digital_out[2]", by an old name: the index, and where a value is given that, too.
  void signal(const Token& name, std::string_view builtin, bool given);
  /// A number as it stands there.
  void number();
  /// clear_interpreter() is called, outside of functions.
  [[nodiscard]] bool clears_interpreter() const { return clears_interpreter_; }

 private:
  // From the weakest binding.
  void either();
  void both();
  void negation();
  void comparison();
  void sum();
  void product();
  void sign();
  void element();
  void primary();

  void method();
  void change(const Token& variable);
  void named(const Token& token);
  void pose(const Token& token);
  void structure();
  void run_thread();
  void call(const Token& name);
  void call_builtin(const Token& name, int builtin);
  [[nodiscard]] int elements(std::string_view closing);
  [[nodiscard]] int indices();
  void arguments(const Token& name, const std::vector<Parameter>& parameters);
  void fail_arguments(const Token& name);

  TokenCursor& tokens_;
  CodeWriter& writer_;
  bool clears_interpreter_ = false;
};

}  // namespace firstlook::sim::ur::script
