#include "hal/sim/ur_controller/script/compiler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/script/names.hpp"

namespace firstlook::sim::ur::script {
namespace {

using Kind = Token::Kind;

constexpr int kNestingMax = 100;  // of blocks and of expressions
constexpr std::size_t kInstructionsMax = 200'000;

class Compiler {
 public:
  /// Adds to `code`, which must outlive the compiler.
  Compiler(std::string_view script, std::vector<Token> tokens, Code& code)
      : script_(script), tokens_(std::move(tokens)), code_(code) {}

  [[nodiscard]] std::optional<ScriptError> program() {
    const Names names = find_program_names(tokens_);
    for (const Token& name : names.declared) declare_global(name.text);
    for (const std::string& name : names.assigned) declare_global(name);
    declare_functions(names);
    code_.name = "unnamed";
    skip_line_ends();
    const bool whole = tokens_[at_].is("def") || tokens_[at_].is("sec");
    if (whole) {
      code_.secondary = tokens_[at_].is("sec");
      code_.name = tokens_[at_ + 1].text;
      code_.main = function(true);
      skip_line_ends();
      if (tokens_[at_].kind != Kind::kEnd) fail_here();
    } else {
      code_.main = body("unnamed");
    }
    keep_function_numbers();
    return error_;
  }

  [[nodiscard]] std::expected<StatementLine, ScriptError> statements(int enclosing) {
    interpreted_ = true;
    const Names names = find_statement_names(tokens_);
    const std::vector<std::string> enclosing_locals = code_.functions[static_cast<std::size_t>(enclosing)].locals;
    for (const Token& name : names.declared) {
      if (!code_.global_numbers.contains(name.text)) fail_new_global(name);
    }
    for (const std::string& name : names.assigned) {
      if (std::ranges::find(enclosing_locals, name) == enclosing_locals.end()) declare_global(name);
    }
    declare_functions(names);
    StatementLine line;
    line.function = body("", enclosing_locals);
    code_.functions[static_cast<std::size_t>(line.function)].locals.clear();  // it brings none of its own
    line.clears = clears_;
    if (error_) return std::unexpected(*error_);
    keep_function_numbers();
    return line;
  }

 private:
  struct Scope {
    Function function;
    bool top = false;
    int number = 0;
    std::map<std::string, int> locals;
    std::vector<std::vector<std::size_t>> breaks;  ///< jumps out of each loop, to be aimed at its end
    std::vector<int> loop_begins;
  };

  // --- errors ---
  void fail(ScriptError error) {
    if (!error_) error_ = std::move(error);
    at_ = tokens_.size() - 1;  // nothing more to read: every loop ends
  }
  void fail_here() { fail(syntax_error(script_, tokens_[at_].line, tokens_[at_].column)); }
  void fail_name(const Token& name) {
    fail({name.line, name.column, fmt::format("compile_error_name_not_found:{}:", name.text)});
  }
  void fail_new_global(const Token& name) {
    fail({name.line, name.column, fmt::format("compile_error_new_global:{}:", name.text)});
  }

  // --- tokens ---
  [[nodiscard]] const Token& now() const { return tokens_[at_]; }
  [[nodiscard]] const Token& ahead() const { return tokens_[std::min(at_ + 1, tokens_.size() - 1)]; }
  void advance() {
    if (at_ + 1 < tokens_.size()) ++at_;
  }
  bool accept(std::string_view symbol) {
    if (!now().is(symbol)) return false;
    advance();
    return true;
  }
  void expect(std::string_view symbol) {
    if (!accept(symbol)) fail_here();
  }
  std::string expect_name() {
    if (now().kind != Kind::kName) {
      fail_here();
      return {};
    }
    std::string name = now().text;
    advance();
    return name;
  }
  /// More than one statement may stand on a line.
  void end_statement() {
    if (now().kind == Kind::kEnd || now().kind == Kind::kName) return;
    if (now().kind != Kind::kLineEnd) return fail_here();
    advance();
  }
  void skip_line_ends() {
    while (now().kind == Kind::kLineEnd) advance();
  }

  // --- names ---
  void declare_functions(const Names& names) {
    parameters_ = names.functions;
    for (const auto& [name, parameters] : names.functions) function_numbers_[name] = kNotYetMet;
  }
  void keep_function_numbers() {
    for (const auto& [name, number] : function_numbers_) code_.function_numbers[name] = number;
  }
  [[nodiscard]] bool is_function(const std::string& name) const {
    return function_numbers_.contains(name) || code_.function_numbers.contains(name);
  }
  [[nodiscard]] std::vector<std::string> parameters_of_function(const std::string& name) const {
    if (const auto here = parameters_.find(name); here != parameters_.end()) return here->second;
    const Function& before = code_.functions[static_cast<std::size_t>(code_.function_numbers.at(name))];
    return {before.locals.begin(), before.locals.begin() + before.parameters};
  }
  void declare_global(const std::string& name) {
    if (code_.global_numbers.contains(name)) return;
    code_.global_numbers[name] = static_cast<int>(code_.globals.size());
    code_.globals.push_back(name);
  }
  int declare_local(const std::string& name) {
    Scope& scope = scopes_.back();
    const auto [entry, added] = scope.locals.emplace(name, static_cast<int>(scope.function.locals.size()));
    if (added) scope.function.locals.push_back(name);
    return entry->second;
  }

  // --- code ---
  int emit(Op op, int a = 0, int b = 0) { return emit_at(now(), op, a, b); }
  int emit_at(const Token& where, Op op, int a = 0, int b = 0) {
    std::vector<Instruction>& instructions = scopes_.back().function.instructions;
    if (++instructions_ > kInstructionsMax) fail({where.line, where.column, "compile_error_program_too_large:"});
    instructions.push_back({op, a, b, where.line, where.column});
    return static_cast<int>(instructions.size()) - 1;
  }
  [[nodiscard]] int here() const { return static_cast<int>(scopes_.back().function.instructions.size()); }
  void aim(int instruction) { scopes_.back().function.instructions[static_cast<std::size_t>(instruction)].a = here(); }
  void constant(Value value) {
    code_.constants.push_back(std::move(value));
    emit(Op::kConstant, static_cast<int>(code_.constants.size()) - 1);
  }

  // --- functions ---
  void begin_function(const std::string& name, bool top) {
    Scope scope;
    scope.function.name = name;
    scope.top = top;
    scope.number = function_number(name, top);
    scopes_.push_back(std::move(scope));
  }
  /// Of a function of this script; the same whether it is called first or defined.
  int function_number(const std::string& name, bool top) {
    const auto known = top ? function_numbers_.end() : function_numbers_.find(name);
    if (known != function_numbers_.end() && known->second != kNotYetMet) return known->second;
    code_.functions.emplace_back();
    const int number = static_cast<int>(code_.functions.size()) - 1;
    if (known != function_numbers_.end()) known->second = number;
    return number;
  }
  /// And of one of the program that this is compiled into.
  int called_number(const std::string& name) {
    return function_numbers_.contains(name) ? function_number(name, false) : code_.function_numbers.at(name);
  }
  int end_function() {
    if (interpreted_ && scopes_.size() == 1) {
      emit(Op::kEndStatement);
    } else {
      code_.constants.emplace_back();
      emit(Op::kConstant, static_cast<int>(code_.constants.size()) - 1);
      emit(Op::kReturn);
    }
    const int number = scopes_.back().number;
    code_.functions[static_cast<std::size_t>(number)] = std::move(scopes_.back().function);
    scopes_.pop_back();
    return number;
  }
  /// Statements to the end of the script, which see these locals.
  int body(const std::string& name, const std::vector<std::string>& locals = {}) {
    begin_function(name, true);
    for (const std::string& local : locals) declare_local(local);
    while (!error_ && tokens_[at_].kind != Kind::kEnd) statement();
    return end_function();
  }
  /// From `def`, `sec` or `thread` to its `end`.
  int function(bool top) {
    if (scopes_.size() >= kNestingMax) return fail_here(), 0;
    const bool thread = now().is("thread");
    advance();
    const std::string name = expect_name();
    begin_function(name, top);
    scopes_.back().function.thread = thread;
    expect("(");
    while (!error_ && !now().is(")")) {
      const int local = declare_local(expect_name());
      ++scopes_.back().function.parameters;
      if (accept("=")) default_value(local);
      if (!accept(",")) break;
    }
    expect(")");
    expect(":");
    block();
    expect("end");
    if (!error_) end_statement();
    return end_function();
  }

  /// Evaluated in the function, when the caller gave nothing.
  void default_value(int local) {
    const int given = emit(Op::kJumpIfSet, 0, local);
    expression();
    emit(Op::kStoreLocal, local);
    aim(given);
  }

  // --- statements ---
  void block() {
    if (++nesting_ > kNestingMax) fail_here();
    skip_line_ends();
    while (!error_ && !ends_block()) {
      if (now().kind == Kind::kEnd) return fail_here();
      statement();
    }
    --nesting_;
  }

  [[nodiscard]] bool ends_block() const { return now().is("end") || now().is("elif") || now().is("else"); }

  void statement() {
    skip_line_ends();
    if (now().kind == Kind::kEnd || error_) return;
    if (now().is("def") || now().is("thread")) {
      static_cast<void>(function(false));
    } else if (now().is("$")) {
      label();
    } else if (now().is("if")) {
      if_statement();
    } else if (now().is("while")) {
      while_statement();
    } else if (now().is("return")) {
      return_statement();
    } else if (now().is("break") || now().is("continue")) {
      leave_loop();
    } else if (accept("halt")) {
      emit(Op::kHalt);
      end_statement();
    } else if (accept("pass")) {
      end_statement();
    } else if (accept("enter_critical")) {
      emit(Op::kEnterCritical);
      end_statement();
    } else if (accept("exit_critical")) {
      emit(Op::kExitCritical);
      end_statement();
    } else if (now().is("join") || now().is("kill")) {
      const Op op = now().is("join") ? Op::kJoin : Op::kKill;
      advance();
      expression();
      emit(op);
      end_statement();
    } else {
      assignment_or_call();
    }
    skip_line_ends();
  }

  /// $ 3 "Move", and with it "breakAfter" or the like: where in a program of the pendant's the lines below come from.
  void label() {
    const Token where = now();
    advance();
    if (now().kind != Kind::kInteger) return fail_here();
    constant(number(now()));
    advance();
    if (now().kind != Kind::kText) return fail_here();
    constant(now().text);
    advance();
    if (now().kind == Kind::kText) advance();
    emit_at(where, Op::kCallBuiltin, find_builtin("$"), 2);
    emit(Op::kPop);
    end_statement();
  }

  void return_statement() {
    if (interpreted_ && scopes_.size() == 1) return fail_here();
    advance();
    if (now().kind == Kind::kLineEnd || ends_block()) {
      constant({});
    } else {
      expression();
    }
    emit(Op::kReturn);
    end_statement();
  }

  void if_statement() {
    std::vector<int> to_end;
    do {
      advance();  // if, elif
      expression();
      expect(":");
      const int otherwise = emit(Op::kJumpIfFalse);
      block();
      to_end.push_back(emit(Op::kJump));
      aim(otherwise);
    } while (!error_ && now().is("elif"));
    if (accept("else")) {
      expect(":");
      block();
    }
    expect("end");
    for (const int jump : to_end) aim(jump);
    if (!error_) end_statement();
  }

  void while_statement() {
    advance();
    const int begin = here();
    scopes_.back().loop_begins.push_back(begin);
    scopes_.back().breaks.emplace_back();
    expression();
    expect(":");
    const int leave = emit(Op::kJumpIfFalse);
    block();
    expect("end");
    emit(Op::kJump, begin);
    aim(leave);
    for (const std::size_t jump : scopes_.back().breaks.back()) aim(static_cast<int>(jump));
    scopes_.back().breaks.pop_back();
    scopes_.back().loop_begins.pop_back();
    if (!error_) end_statement();
  }

  void leave_loop() {
    Scope& scope = scopes_.back();
    if (scope.breaks.empty()) return fail_here();
    if (now().is("break")) {
      scope.breaks.back().push_back(static_cast<std::size_t>(emit(Op::kJump)));
    } else {
      emit(Op::kJump, scope.loop_begins.back());
    }
    advance();
    end_statement();
  }

  void assignment_or_call() {
    const bool global = now().is("global"), local = now().is("local");
    if (global || local) advance();
    if (now().kind == Kind::kName && assigns(tokens_, at_)) {
      assignment(global, local);
    } else if (global && now().kind == Kind::kName) {
      advance();  // a declaration alone
    } else if (global || local) {
      fail_here();
    } else {
      expression();
      emit(Op::kPop);
    }
    end_statement();
  }

  [[nodiscard]] bool known(const std::string& name) const {
    return scopes_.back().locals.contains(name) || code_.global_numbers.contains(name);
  }

  /// The index, and where a value is given that, too.
  void signal(const Token& name, std::string_view builtin, bool given) {
    advance();
    expect("[");
    expression();
    expect("]");
    if (given) {
      expect("=");
      expression();
    }
    emit_at(name, Op::kCallBuiltin, find_builtin(builtin), given ? 2 : 1);
  }

  void assignment(bool global, bool local) {
    const Token target = now();
    if (sets_signal(tokens_, at_) && !known(target.text)) {
      signal(target, "set_digital_out", true);
      emit(Op::kPop);
      return;
    }
    advance();
    int indices = 0;
    if (now().is("[")) load(target);
    while (accept("[")) {
      expression();
      expect("]");
      ++indices;
    }
    expect("=");
    expression();
    if (indices > 0) emit_at(target, Op::kSetElement, indices);
    store(target, global, local);
  }

  void store(const Token& target, bool global, bool local) {
    Scope& scope = scopes_.back();
    const bool shared = code_.global_numbers.contains(target.text);
    const bool own = scope.locals.contains(target.text);
    if (global || (shared && !own && !(local && !scope.top))) {
      emit_at(target, Op::kStoreGlobal, code_.global_numbers[target.text]);
    } else if (interpreted_ && scopes_.size() == 1 && !own) {
      declare_global(target.text);  // the frame is another function's: it has no room for more
      emit_at(target, Op::kStoreGlobal, code_.global_numbers[target.text]);
    } else {
      emit_at(target, Op::kStoreLocal, declare_local(target.text));
    }
  }

  void load(const Token& name) {
    const Scope& scope = scopes_.back();
    if (const auto own = scope.locals.find(name.text); own != scope.locals.end()) {
      emit_at(name, Op::kLoadLocal, own->second);
    } else if (const auto shared = code_.global_numbers.find(name.text); shared != code_.global_numbers.end()) {
      emit_at(name, Op::kLoadGlobal, shared->second);
    } else {
      fail_name(name);
    }
  }

  // --- expressions, from the weakest binding ---
  void expression() {
    if (++nesting_ > kNestingMax) fail_here();
    either();
    --nesting_;
  }
  void either() {
    both();
    while (!error_ && (now().is("or") || now().is("xor"))) {
      if (accept("xor")) {
        both();
        emit(Op::kBinary, static_cast<int>(BinaryOp::kXor));
        continue;
      }
      advance();
      const int jump = emit(Op::kJumpIfTrueKeep);
      both();
      aim(jump);
    }
  }
  void both() {
    negation();
    while (!error_ && accept("and")) {
      const int jump = emit(Op::kJumpIfFalseKeep);
      negation();
      aim(jump);
    }
  }
  void negation() {
    if (now().is("not")) {
      if (++nesting_ > kNestingMax) fail_here();
      advance();
      negation();
      emit(Op::kNot);
      --nesting_;
      return;
    }
    comparison();
  }
  void comparison() {
    sum();
    const std::map<std::string_view, BinaryOp> operators = {
        {"==", BinaryOp::kEqual},  {"!=", BinaryOp::kNotEqual},    {"<", BinaryOp::kLess},
        {">", BinaryOp::kGreater}, {"<=", BinaryOp::kLessOrEqual}, {">=", BinaryOp::kGreaterOrEqual},
    };
    while (!error_) {
      const auto found = operators.find(now().text);
      if (now().kind != Kind::kSymbol || found == operators.end()) return;
      const Token where = now();
      advance();
      sum();
      emit_at(where, Op::kBinary, static_cast<int>(found->second));
    }
  }
  void sum() {
    product();
    while (!error_ && (now().is("+") || now().is("-"))) {
      const Token where = now();
      advance();
      product();
      emit_at(where, Op::kBinary, static_cast<int>(where.is("+") ? BinaryOp::kAdd : BinaryOp::kSubtract));
    }
  }
  void product() {
    sign();
    while (!error_ && (now().is("*") || now().is("/") || now().is("%"))) {
      const Token where = now();
      advance();
      sign();
      const BinaryOp op = where.is("*") ? BinaryOp::kMultiply : where.is("/") ? BinaryOp::kDivide : BinaryOp::kModulo;
      emit_at(where, Op::kBinary, static_cast<int>(op));
    }
  }
  void sign() {
    if (now().is("-") || now().is("+")) {
      const Token where = now();
      if (++nesting_ > kNestingMax) fail_here();
      advance();
      sign();
      if (where.is("-")) emit_at(where, Op::kNegate);
      --nesting_;
      return;
    }
    element();
  }
  void element() {
    primary();
    while (!error_ && (now().is("[") || now().is("."))) {
      const Token where = now();
      if (where.is(".")) {
        method();
        continue;
      }
      advance();
      expression();
      expect("]");
      emit_at(where, Op::kIndex);
    }
  }

  /// handle.method(arguments), which are by position alone.
  void method() {
    advance();
    const Token name = now();
    constant(expect_name());
    expect("(");
    const int count = elements(")");
    emit_at(name, Op::kCallBuiltin, find_builtin("."), count + 2);
  }

  void primary() {
    const Token token = now();
    switch (token.kind) {
      case Kind::kInteger:
      case Kind::kFloat:
        advance();
        return constant(number(token));
      case Kind::kText:
        advance();
        return constant(token.text);
      case Kind::kName:
        return named(token);
      case Kind::kSymbol:
        if (accept("(")) {
          expression();
          return expect(")");
        }
        if (accept("[")) return list();
        break;
      default:
        break;
    }
    fail_here();
  }

  Value number(const Token& token) {
    const char* const begin = token.text.data();
    const char* const end = begin + token.text.size();
    if (token.kind == Kind::kInteger) {
      std::int64_t integer = 0;
      if (std::from_chars(begin, end, integer).ec == std::errc{} && integer <= INT32_MAX) return integer;
    }
    double real = 0;
    std::from_chars(begin, end, real);
    return real;
  }

  /// Expressions up to the closing bracket; how many.
  int elements(std::string_view closing) {
    int count = 0;
    while (!error_ && !now().is(closing)) {
      expression();
      ++count;
      if (!accept(",")) break;
    }
    expect(closing);
    return count;
  }

  void list() { emit(Op::kMakeList, elements("]")); }

  void named(const Token& token) {
    if (token.is("True") || token.is("False")) {
      advance();
      return constant(token.is("True"));
    }
    if (token.is("run")) return run_thread();
    if (token.is("p") && ahead().is("[")) return pose(token);
    if (ahead().is("(")) return call(token);
    // Signals by their old names, as the scripts of older clients have them.
    constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kSignals = {
        {{"digital_in", "get_digital_in"}, {"digital_out", "get_digital_out"}, {"analog_in", "get_analog_in"}}};
    for (const auto& [name, builtin] : kSignals) {
      if (token.is(name) && ahead().is("[") && !known(token.text)) return signal(token, builtin, false);
    }
    advance();
    load(token);
  }

  /// p[x, y, z, rx, ry, rz]; with one value an element of a variable of that name.
  void pose(const Token& token) {
    advance();
    advance();
    const int begin = here();
    const int count = elements("]");
    if (error_) return;
    if (count == 6) {
      emit_at(token, Op::kMakePose);
    } else if (count == 1) {
      std::vector<Instruction>& instructions = scopes_.back().function.instructions;
      const std::vector<Instruction> index(instructions.begin() + begin, instructions.end());
      if (std::ranges::any_of(index, [](const Instruction& i) { return i.op >= Op::kJump && i.op < Op::kPop; })) {
        return fail(syntax_error(script_, token.line, token.column));
      }
      instructions.resize(static_cast<std::size_t>(begin));
      load(token);
      instructions.insert(instructions.end(), index.begin(), index.end());
      emit_at(token, Op::kIndex);
    } else {
      fail(syntax_error(script_, token.line, token.column));
    }
  }

  void run_thread() {
    advance();
    const Token name = now();
    if (name.kind != Kind::kName || !is_function(name.text)) return fail_name(name);
    advance();
    expect("(");
    expect(")");
    emit_at(name, Op::kRun, called_number(name.text));
  }

  void call(const Token& name) {
    advance();
    advance();
    if (is_function(name.text)) return call_function(name);
    const int builtin = find_builtin(name.text);
    if (builtin < 0) return fail_name(name);
    call_builtin(name, builtin);
  }

  void call_function(const Token& name) {
    std::vector<Parameter> parameters;
    for (const std::string& parameter : parameters_of_function(name.text)) parameters.push_back({parameter, true, {}});
    arguments(name, parameters);
    emit_at(name, Op::kCall, called_number(name.text), static_cast<int>(parameters.size()));
  }

  void call_builtin(const Token& name, int builtin) {
    const bool interprets = name.is("interpreter_mode");
    if (interprets && interpreted_) return fail({name.line, name.column, "compile_error_nested_interpreter_mode:"});
    clears_ = clears_ || (name.is("clear_interpreter") && scopes_.size() == 1);
    const std::vector<Parameter> parameters = parameters_of(builtin);
    arguments(name, parameters);
    emit_at(name, Op::kCallBuiltin, builtin, static_cast<int>(parameters.size()));
    if (interprets) emit_at(name, Op::kInterpret);
  }

  /// Arguments by position or by name, and the defaults of the others, pushed in the order of the parameters.
  void arguments(const Token& name, const std::vector<Parameter>& parameters) {
    std::vector<std::vector<Instruction>> given(parameters.size());
    std::size_t position = 0;
    while (!error_ && !now().is(")")) {
      std::size_t index = position++;
      if (now().kind == Kind::kName && ahead().is("=")) {
        const auto found = std::ranges::find(parameters, now().text, &Parameter::name);
        index = static_cast<std::size_t>(found - parameters.begin());
        advance();
        advance();
      }
      if (index >= parameters.size() || !given[index].empty()) return fail_arguments(name);
      given[index] = apart([this] { expression(); });
      if (!accept(",")) break;
    }
    expect(")");
    if (error_) return;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      if (!given[i].empty()) {
        append(given[i]);
      } else if (parameters[i].has_default) {
        code_.constants.push_back(parameters[i].default_value);
        emit_at(name, Op::kConstant, static_cast<int>(code_.constants.size()) - 1);
      } else {
        return fail_arguments(name);
      }
    }
  }
  void fail_arguments(const Token& name) {
    fail({name.line, name.column, fmt::format("compile_error_wrong_arguments:{}:", name.text)});
  }

  /// Code that is moved to its place later: jumps in it are relative to its begin.
  template <typename Emit>
  std::vector<Instruction> apart(const Emit& emit_code) {
    std::vector<Instruction>& instructions = scopes_.back().function.instructions;
    const auto begin = static_cast<std::ptrdiff_t>(instructions.size());
    emit_code();
    std::vector<Instruction> taken(instructions.begin() + begin, instructions.end());
    instructions.resize(static_cast<std::size_t>(begin));
    for (Instruction& i : taken) {
      if (i.op >= Op::kJump && i.op < Op::kPop) i.a -= static_cast<int>(begin);
    }
    return taken;
  }
  void append(const std::vector<Instruction>& code) {
    const int begin = here();
    for (Instruction i : code) {
      if (i.op >= Op::kJump && i.op < Op::kPop) i.a += begin;
      scopes_.back().function.instructions.push_back(i);
    }
  }

  static constexpr int kNotYetMet = -1;

  std::string_view script_;
  std::vector<Token> tokens_;
  Code& code_;
  std::size_t at_ = 0;
  std::optional<ScriptError> error_;
  std::vector<Scope> scopes_;
  std::map<std::string, int> function_numbers_;                 ///< of the functions of this script
  std::map<std::string, std::vector<std::string>> parameters_;  ///< and their parameters
  bool interpreted_ = false;  ///< statements for another function's frame, which is the first scope
  bool clears_ = false;
  int nesting_ = 0;
  std::size_t instructions_ = 0;
};

}  // namespace

std::expected<Code, ScriptError> compile(std::string_view script) {
  auto tokens = tokenize(script);
  if (!tokens) return std::unexpected(tokens.error());
  Code code;
  if (auto error = Compiler(script, std::move(*tokens), code).program()) return std::unexpected(std::move(*error));
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
  auto compiled = Compiler(line, std::move(*tokens), code).statements(scope);
  if (!compiled) shorten(code, functions, constants, globals);
  return compiled;
}

}  // namespace firstlook::sim::ur::script
