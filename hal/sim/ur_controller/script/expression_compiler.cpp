#include "hal/sim/ur_controller/script/expression_compiler.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <utility>

namespace firstlook::sim::ur::script {
namespace {

using Kind = Token::Kind;

Value number_of(const Token& token) {
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

}  // namespace

void ExpressionCompiler::expression() {
  tokens_.enter();
  either();
  tokens_.leave();
}

void ExpressionCompiler::either() {
  both();
  while (!tokens_.failed() && (tokens_.now().is("or") || tokens_.now().is("xor"))) {
    if (tokens_.accept("xor")) {
      both();
      writer_.emit(Op::kBinary, static_cast<int>(BinaryOp::kXor));
      continue;
    }
    tokens_.advance();
    const int jump = writer_.emit(Op::kJumpIfTrueKeep);
    both();
    writer_.aim(jump);
  }
}

void ExpressionCompiler::both() {
  negation();
  while (!tokens_.failed() && tokens_.accept("and")) {
    const int jump = writer_.emit(Op::kJumpIfFalseKeep);
    negation();
    writer_.aim(jump);
  }
}

void ExpressionCompiler::negation() {
  if (!tokens_.now().is("not")) return comparison();
  tokens_.enter();
  tokens_.advance();
  negation();
  writer_.emit(Op::kNot);
  tokens_.leave();
}

void ExpressionCompiler::comparison() {
  sum();
  const std::map<std::string_view, BinaryOp> operators = {
      {"==", BinaryOp::kEqual},  {"!=", BinaryOp::kNotEqual},    {"<", BinaryOp::kLess},
      {">", BinaryOp::kGreater}, {"<=", BinaryOp::kLessOrEqual}, {">=", BinaryOp::kGreaterOrEqual},
  };
  while (!tokens_.failed()) {
    const Token where = tokens_.now();
    const auto found = operators.find(where.text);
    if (where.kind != Kind::kSymbol || found == operators.end()) return;
    tokens_.advance();
    sum();
    writer_.emit_at(where, Op::kBinary, static_cast<int>(found->second));
  }
}

void ExpressionCompiler::sum() {
  product();
  while (!tokens_.failed() && (tokens_.now().is("+") || tokens_.now().is("-"))) {
    const Token where = tokens_.now();
    tokens_.advance();
    product();
    writer_.emit_at(where, Op::kBinary, static_cast<int>(where.is("+") ? BinaryOp::kAdd : BinaryOp::kSubtract));
  }
}

void ExpressionCompiler::product() {
  sign();
  while (!tokens_.failed() && (tokens_.now().is("*") || tokens_.now().is("/") || tokens_.now().is("%"))) {
    const Token where = tokens_.now();
    tokens_.advance();
    sign();
    const BinaryOp op = where.is("*") ? BinaryOp::kMultiply : where.is("/") ? BinaryOp::kDivide : BinaryOp::kModulo;
    writer_.emit_at(where, Op::kBinary, static_cast<int>(op));
  }
}

void ExpressionCompiler::sign() {
  const Token where = tokens_.now();
  if (!where.is("-") && !where.is("+")) return element();
  tokens_.enter();
  tokens_.advance();
  sign();
  if (where.is("-")) writer_.emit_at(where, Op::kNegate);
  tokens_.leave();
}

void ExpressionCompiler::element() {
  primary();
  while (!tokens_.failed()) {
    const Token where = tokens_.now();
    if (where.is(".") && tokens_.ahead(2).is("(")) {
      method();
    } else if (where.is(".") || where.is("[")) {
      const int count = place();
      writer_.emit_at(where, Op::kIndex, count);
    } else {
      return;
    }
  }
}

int ExpressionCompiler::place() {
  int count = 0;
  while (!tokens_.failed()) {
    if (tokens_.accept("[")) {
      count += indices();
    } else if (tokens_.now().is(".") && !tokens_.ahead(2).is("(")) {
      tokens_.advance();
      writer_.constant(tokens_.expect_member());
      ++count;
    } else {
      break;
    }
  }
  return count;
}

/// a[1] or, of a matrix, a[1, 2].
int ExpressionCompiler::indices() {
  const int count = elements("]");
  if (count == 0) tokens_.fail_here();
  return count;
}

/// handle.method(arguments), which are by position alone.
void ExpressionCompiler::method() {
  tokens_.advance();
  const Token name = tokens_.now();
  writer_.constant(tokens_.expect_name());
  tokens_.expect("(");
  const int count = elements(")");
  writer_.emit_at(name, Op::kCallBuiltin, find_builtin("."), count + 2);
}

/// variable[2].append(...): the variable's slot, how many values lead to the list, those values, the method, its
/// arguments.
void ExpressionCompiler::change(const Token& variable) {
  tokens_.advance();
  int depth = 0;
  const std::vector<Instruction> path = writer_.apart([&] { depth = place(); });
  writer_.constant(std::int64_t{writer_.slot_of(variable, false, false)});
  writer_.constant(std::int64_t{depth});
  writer_.append(path);
  tokens_.expect(".");
  writer_.constant(tokens_.expect_name());
  tokens_.expect("(");
  const int count = elements(")");
  writer_.emit_at(variable, Op::kCallBuiltin, find_builtin(".="), depth + count + 3);
}

void ExpressionCompiler::primary() {
  const Token token = tokens_.now();
  switch (token.kind) {
    case Kind::kInteger:
    case Kind::kFloat:
      return number();
    case Kind::kText:
      tokens_.advance();
      return writer_.constant(token.text);
    case Kind::kName:
      return named(token);
    case Kind::kSymbol:
      if (tokens_.accept("(")) {
        expression();
        return tokens_.expect(")");
      }
      if (tokens_.accept("[")) {
        const int count = elements("]");
        writer_.emit(Op::kMakeList, count);
        return;
      }
      break;
    default:
      break;
  }
  tokens_.fail_here();
}

void ExpressionCompiler::number() {
  const Token token = tokens_.now();
  tokens_.advance();
  writer_.constant(number_of(token));
}

/// Expressions up to the closing bracket; how many.
int ExpressionCompiler::elements(std::string_view closing) {
  int count = 0;
  while (!tokens_.failed() && !tokens_.now().is(closing)) {
    expression();
    ++count;
    if (!tokens_.accept(",")) break;
  }
  tokens_.expect(closing);
  return count;
}

void ExpressionCompiler::named(const Token& token) {
  if (token.is("True") || token.is("False")) {
    tokens_.advance();
    return writer_.constant(token.is("True"));
  }
  if (token.is("run")) return run_thread();
  if (token.is("p") && tokens_.ahead().is("[")) return pose(token);
  if (tokens_.ahead().is("(")) return call(token);
  const bool variable = writer_.is_variable(token.text);
  if (variable && changes_list(tokens_.all(), tokens_.position())) return change(token);
  // Signals by their old names, as the scripts of older clients have them.
  constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kSignals = {
      {{"digital_in", "get_digital_in"}, {"digital_out", "get_digital_out"}, {"analog_in", "get_analog_in"}}};
  for (const auto& [name, builtin] : kSignals) {
    if (token.is(name) && tokens_.ahead().is("[") && !variable) return signal(token, builtin, false);
  }
  tokens_.advance();
  writer_.load(token);
}

void ExpressionCompiler::signal(const Token& name, std::string_view builtin, bool given) {
  tokens_.advance();
  tokens_.expect("[");
  expression();
  tokens_.expect("]");
  if (given) {
    tokens_.expect("=");
    expression();
  }
  writer_.emit_at(name, Op::kCallBuiltin, find_builtin(builtin), given ? 2 : 1);
}

/// p[x, y, z, rx, ry, rz]; with fewer values an element of a variable of that name.
void ExpressionCompiler::pose(const Token& token) {
  if (writer_.is_variable(token.text) && changes_list(tokens_.all(), tokens_.position())) return change(token);
  tokens_.advance();
  tokens_.advance();
  int count = 0;
  const std::vector<Instruction> values = writer_.apart([&] { count = elements("]"); });
  if (tokens_.failed()) return;
  if (count == 6) {
    writer_.append(values);
    writer_.emit_at(token, Op::kMakePose);
  } else if (count == 1 || (count > 0 && writer_.is_variable(token.text))) {
    writer_.load(token);
    writer_.append(values);
    writer_.emit_at(token, Op::kIndex, count);
  } else {
    tokens_.fail_syntax(token);
  }
}

/// struct(name = value, ...): names and values in turn.
void ExpressionCompiler::structure() {
  const Token where = tokens_.now();
  tokens_.advance();
  tokens_.advance();
  int members = 0;
  do {
    writer_.constant(tokens_.expect_member());
    tokens_.expect("=");
    expression();
    ++members;
  } while (!tokens_.failed() && tokens_.accept(",") && !tokens_.now().is(")"));
  tokens_.expect(")");
  writer_.emit_at(where, Op::kCallBuiltin, find_builtin("struct"), 2 * members);
}

void ExpressionCompiler::run_thread() {
  tokens_.advance();
  const Token name = tokens_.now();
  if (name.kind != Kind::kName || !writer_.is_function(name.text)) return writer_.fail_name(name);
  tokens_.advance();
  tokens_.expect("(");
  tokens_.expect(")");
  writer_.emit_at(name, Op::kRun, writer_.called_number(name.text));
}

void ExpressionCompiler::call(const Token& name) {
  const bool own = writer_.is_function(name.text);
  if (name.is("struct") && !own) return structure();
  tokens_.advance();
  tokens_.advance();
  if (!own) return call_builtin(name, find_builtin(name.text));
  std::vector<Parameter> parameters;
  for (const std::string& parameter : writer_.parameters_of(name.text)) parameters.push_back({parameter, true, {}});
  arguments(name, parameters);
  writer_.emit_at(name, Op::kCall, writer_.called_number(name.text), static_cast<int>(parameters.size()));
}

void ExpressionCompiler::call_builtin(const Token& name, int builtin) {
  if (builtin < 0) return writer_.fail_name(name);
  const bool interprets = name.is("interpreter_mode");
  if (interprets && writer_.interpreted()) {
    return tokens_.fail({name.line, name.column, "compile_error_nested_interpreter_mode:"});
  }
  clears_interpreter_ = clears_interpreter_ || (name.is("clear_interpreter") && writer_.depth() == 1);
  const std::vector<Parameter> parameters = parameters_of(builtin);
  arguments(name, parameters);
  writer_.emit_at(name, Op::kCallBuiltin, builtin, static_cast<int>(parameters.size()));
  if (interprets) writer_.emit_at(name, Op::kInterpret);
}

/// Arguments by position or by name, and the defaults of the others, pushed in the order of the parameters.
void ExpressionCompiler::arguments(const Token& name, const std::vector<Parameter>& parameters) {
  std::vector<std::vector<Instruction>> given(parameters.size());
  std::size_t position = 0;
  while (!tokens_.failed() && !tokens_.now().is(")")) {
    std::size_t index = position++;
    if (tokens_.now().kind == Kind::kName && tokens_.ahead().is("=")) {
      const auto found = std::ranges::find(parameters, tokens_.now().text, &Parameter::name);
      index = static_cast<std::size_t>(found - parameters.begin());
      tokens_.advance();
      tokens_.advance();
    }
    if (index >= parameters.size() || !given[index].empty()) return fail_arguments(name);
    given[index] = writer_.apart([this] { expression(); });
    if (!tokens_.accept(",")) break;
  }
  tokens_.expect(")");
  for (std::size_t i = 0; i < parameters.size() && !tokens_.failed(); ++i) {
    if (!given[i].empty()) {
      writer_.append(given[i]);
    } else if (parameters[i].has_default) {
      writer_.constant(parameters[i].default_value);
    } else {
      fail_arguments(name);
    }
  }
}

void ExpressionCompiler::fail_arguments(const Token& name) {
  tokens_.fail({name.line, name.column, fmt::format("compile_error_wrong_arguments:{}:", name.text)});
}

}  // namespace firstlook::sim::ur::script
