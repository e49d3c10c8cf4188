#include "hal/sim/ur_controller/script/compiler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/script/code_writer.hpp"
#include "hal/sim/ur_controller/script/expression_compiler.hpp"
#include "hal/sim/ur_controller/script/names.hpp"
#include "hal/sim/ur_controller/script/token_cursor.hpp"

namespace firstlook::sim::ur::script {
namespace {

using Kind = Token::Kind;

constexpr std::size_t kFunctionsWithinMax = 100;

/// Statements and functions.
class Compiler {
 public:
  /// Adds to `code`, which must outlive the compiler.
  /// @param interpreted  it compiles statements for another function's frame, the first scope
  Compiler(std::string_view script, std::vector<Token> tokens, Code& code, bool interpreted)
      : tokens_(script, std::move(tokens)),
        code_(code),
        writer_(tokens_, code, interpreted),
        expressions_(tokens_, writer_) {}

  [[nodiscard]] std::optional<ScriptError> program() {
    const Names names = find_program_names(tokens_.all());
    for (const Token& name : names.declared) writer_.declare_global(name.text);
    for (const std::string& name : names.assigned) writer_.declare_global(name);
    writer_.declare_functions(names);
    code_.name = "unnamed";
    tokens_.skip_line_ends();
    const bool whole = tokens_.now().is("def") || tokens_.now().is("sec");
    if (whole) {
      code_.secondary = tokens_.now().is("sec");
      code_.name = tokens_.ahead().text;
      code_.main = function(true);
      tokens_.skip_line_ends();
      if (!tokens_.at_end()) tokens_.fail_here();
    } else {
      code_.main = body("unnamed");
    }
    writer_.keep_functions();
    return tokens_.error();
  }

  [[nodiscard]] std::expected<StatementLine, ScriptError> statements(int enclosing) {
    const Names names = find_statement_names(tokens_.all());
    const std::vector<std::string> enclosing_locals = code_.functions[static_cast<std::size_t>(enclosing)].locals;
    for (const Token& name : names.declared) {
      if (!code_.global_numbers.contains(name.text)) fail_new_global(name);
    }
    for (const std::string& name : names.assigned) {
      if (std::ranges::find(enclosing_locals, name) == enclosing_locals.end()) writer_.declare_global(name);
    }
    writer_.declare_functions(names);
    StatementLine line;
    line.function = body("", enclosing_locals);
    code_.functions[static_cast<std::size_t>(line.function)].locals.clear();  // it brings none of its own
    line.clears = expressions_.clears_interpreter();
    if (tokens_.failed()) return std::unexpected(*tokens_.error());
    writer_.keep_functions();
    return line;
  }

 private:
  void fail_new_global(const Token& name) {
    tokens_.fail({name.line, name.column, fmt::format("compile_error_new_global:{}:", name.text)});
  }

  // --- functions ---
  /// Statements to the end of the script, which see these locals.
  int body(const std::string& name, const std::vector<std::string>& locals = {}) {
    writer_.begin_function(name, true);
    for (const std::string& local : locals) writer_.declare_local(local);
    while (!tokens_.failed() && !tokens_.at_end()) statement();
    return writer_.end_function();
  }
  /// From `def`, `sec` or `thread` to its `end`.
  int function(bool top) {
    if (writer_.depth() >= kFunctionsWithinMax) return tokens_.fail_here(), 0;
    const bool thread = tokens_.now().is("thread");
    tokens_.advance();
    writer_.begin_function(tokens_.expect_name(), top);
    writer_.function().thread = thread;
    tokens_.expect("(");
    while (!tokens_.failed() && !tokens_.now().is(")")) {
      const int local = writer_.declare_local(tokens_.expect_name());
      ++writer_.function().parameters;
      if (tokens_.accept("=")) default_value(local);
      if (!tokens_.accept(",")) break;
    }
    tokens_.expect(")");
    tokens_.expect(":");
    block();
    tokens_.expect("end");
    tokens_.end_statement();
    return writer_.end_function();
  }

  /// Evaluated in the function, when the caller gave nothing.
  void default_value(int local) {
    const int given = writer_.emit(Op::kJumpIfSet, 0, local);
    expressions_.expression();
    writer_.emit(Op::kStoreLocal, local);
    writer_.aim(given);
  }

  // --- statements ---
  void block() {
    tokens_.enter();
    tokens_.skip_line_ends();
    while (!tokens_.failed() && !tokens_.ends_block()) {
      if (tokens_.at_end()) return tokens_.fail_here();
      statement();
    }
    tokens_.leave();
  }

  void statement() {
    tokens_.skip_line_ends();
    if (tokens_.at_end() || tokens_.failed()) return;
    const Token word = tokens_.now();
    if (word.is("def") || word.is("thread")) {
      static_cast<void>(function(false));
    } else if (word.is("$")) {
      label();
    } else if (word.is("if")) {
      if_statement();
    } else if (word.is("while")) {
      while_statement();
    } else if (word.is("return")) {
      return_statement();
    } else if (word.is("break") || word.is("continue")) {
      leave_loop();
    } else if (tokens_.accept("halt")) {
      writer_.emit(Op::kHalt);
      tokens_.end_statement();
    } else if (tokens_.accept("pass")) {
      tokens_.end_statement();
    } else if (tokens_.accept("enter_critical")) {
      writer_.emit(Op::kEnterCritical);
      tokens_.end_statement();
    } else if (tokens_.accept("exit_critical")) {
      writer_.emit(Op::kExitCritical);
      tokens_.end_statement();
    } else if (word.is("join") || word.is("kill")) {
      tokens_.advance();
      expressions_.expression();
      writer_.emit(word.is("join") ? Op::kJoin : Op::kKill);
      tokens_.end_statement();
    } else {
      assignment_or_call();
    }
    tokens_.skip_line_ends();
  }

  /// $ 3 "Move", and with it "breakAfter" or the like: where in a program of the pendant's the lines below come from.
  void label() {
    const Token where = tokens_.now();
    tokens_.advance();
    if (tokens_.now().kind != Kind::kInteger) return tokens_.fail_here();
    expressions_.number();
    if (tokens_.now().kind != Kind::kText) return tokens_.fail_here();
    writer_.constant(tokens_.now().text);
    tokens_.advance();
    if (tokens_.now().kind == Kind::kText) tokens_.advance();
    writer_.emit_at(where, Op::kCallBuiltin, find_builtin("$"), 2);
    writer_.emit(Op::kPop);
    tokens_.end_statement();
  }

  void return_statement() {
    if (writer_.in_statement_line()) return tokens_.fail_here();
    tokens_.advance();
    if (tokens_.now().kind == Kind::kLineEnd || tokens_.ends_block()) {
      writer_.constant({});
    } else {
      expressions_.expression();
    }
    writer_.emit(Op::kReturn);
    tokens_.end_statement();
  }

  void if_statement() {
    std::vector<int> to_end;
    do {
      tokens_.advance();  // if, elif
      expressions_.expression();
      tokens_.expect(":");
      const int otherwise = writer_.emit(Op::kJumpIfFalse);
      block();
      to_end.push_back(writer_.emit(Op::kJump));
      writer_.aim(otherwise);
    } while (!tokens_.failed() && tokens_.now().is("elif"));
    if (tokens_.accept("else")) {
      tokens_.expect(":");
      block();
    }
    tokens_.expect("end");
    for (const int jump : to_end) writer_.aim(jump);
    tokens_.end_statement();
  }

  void while_statement() {
    tokens_.advance();
    writer_.begin_loop();
    expressions_.expression();
    tokens_.expect(":");
    const int leave = writer_.emit(Op::kJumpIfFalse);
    block();
    tokens_.expect("end");
    writer_.end_loop();
    writer_.aim(leave);
    tokens_.end_statement();
  }

  void leave_loop() {
    const bool in_loop = tokens_.now().is("break") ? writer_.leave_loop() : writer_.repeat_loop();
    if (!in_loop) return tokens_.fail_here();
    tokens_.advance();
    tokens_.end_statement();
  }

  void assignment_or_call() {
    const bool global = tokens_.now().is("global"), local = tokens_.now().is("local");
    if (global || local) tokens_.advance();
    const bool name = tokens_.now().kind == Kind::kName;
    if (name && assigns(tokens_.all(), tokens_.position())) {
      assignment(global, local);
    } else if (global && name) {
      tokens_.advance();  // a declaration alone
    } else if (global || local) {
      tokens_.fail_here();
    } else {
      expressions_.expression();
      writer_.emit(Op::kPop);
    }
    tokens_.end_statement();
  }

  void assignment(bool global, bool local) {
    const Token target = tokens_.now();
    if (sets_signal(tokens_.all(), tokens_.position()) && !writer_.is_variable(target.text)) {
      expressions_.signal(target, "set_digital_out", true);
      writer_.emit(Op::kPop);
      return;
    }
    tokens_.advance();
    const bool element = !tokens_.now().is("=");
    const int slot = element ? writer_.slot_of(target, global, local) : 0;
    const int count = expressions_.place();
    tokens_.expect("=");
    expressions_.expression();
    if (element) {
      writer_.emit_at(target, Op::kSetElement, count, slot);
    } else {
      writer_.store(target, global, local);
    }
  }

  TokenCursor tokens_;
  Code& code_;
  CodeWriter writer_;
  ExpressionCompiler expressions_;
};

}  // namespace

std::expected<Code, ScriptError> compile(std::string_view script) {
  auto tokens = tokenize(script);
  if (!tokens) return std::unexpected(tokens.error());
  Code code;
  if (auto error = Compiler(script, std::move(*tokens), code, false).program())
    return std::unexpected(std::move(*error));
  return code;
}

CodeMark mark_of(const Code& code) {
  return {code.functions.size(), code.constants.size(), code.globals.size(), code.function_numbers};
}

namespace {

/// But for the names of functions.
void shorten(Code& code, std::size_t functions, std::size_t constants, std::size_t globals) {
  for (std::size_t i = globals; i < code.globals.size(); ++i) code.global_numbers.erase(code.globals[i]);
  code.functions.resize(functions);
  code.constants.resize(constants);
  code.globals.resize(globals);
}

}  // namespace

void take_back(Code& code, const CodeMark& mark) {
  shorten(code, mark.functions, mark.constants, mark.globals);
  code.function_numbers = mark.function_numbers;
}

std::expected<StatementLine, ScriptError> compile_statements(std::string_view line, Code& code, int scope) {
  auto tokens = tokenize(line);
  if (!tokens) return std::unexpected(tokens.error());
  const std::size_t functions = code.functions.size(), constants = code.constants.size(), globals = code.globals.size();
  auto compiled = Compiler(line, std::move(*tokens), code, true).statements(scope);
  if (!compiled) shorten(code, functions, constants, globals);
  return compiled;
}

}  // namespace firstlook::sim::ur::script
