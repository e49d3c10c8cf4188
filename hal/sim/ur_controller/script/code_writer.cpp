#include "hal/sim/ur_controller/script/code_writer.hpp"

#include <fmt/format.h>

namespace firstlook::sim::ur::script {
namespace {

constexpr std::size_t kInstructionsMax = 200'000;
constexpr int kNotYetMet = -1;

/// Those that jump to a place in their function.
bool jumps(const Instruction& instruction) { return instruction.op >= Op::kJump && instruction.op < Op::kPop; }

}  // namespace

void CodeWriter::declare_functions(const Names& names) {
  parameters_ = names.functions;
  for (const auto& [name, parameters] : names.functions) function_numbers_[name] = kNotYetMet;
}

void CodeWriter::keep_functions() {
  for (const auto& [name, number] : function_numbers_) code_.function_numbers[name] = number;
}

bool CodeWriter::is_function(const std::string& name) const {
  return function_numbers_.contains(name) || code_.function_numbers.contains(name);
}

std::vector<std::string> CodeWriter::parameters_of(const std::string& function) const {
  if (const auto here = parameters_.find(function); here != parameters_.end()) return here->second;
  const Function& before = code_.functions[static_cast<std::size_t>(code_.function_numbers.at(function))];
  return {before.locals.begin(), before.locals.begin() + before.parameters};
}

void CodeWriter::declare_global(const std::string& name) {
  if (code_.global_numbers.contains(name)) return;
  code_.global_numbers[name] = static_cast<int>(code_.globals.size());
  code_.globals.push_back(name);
}

int CodeWriter::declare_local(const std::string& name) {
  Scope& scope = scopes_.back();
  const auto [entry, added] = scope.locals.emplace(name, static_cast<int>(scope.function.locals.size()));
  if (added) scope.function.locals.push_back(name);
  return entry->second;
}

bool CodeWriter::is_variable(const std::string& name) const {
  return scopes_.back().locals.contains(name) || code_.global_numbers.contains(name);
}

void CodeWriter::begin_function(const std::string& name, bool top) {
  Scope scope;
  scope.function.name = name;
  scope.top = top;
  scope.number = function_number(name, top);
  scopes_.push_back(std::move(scope));
}

int CodeWriter::function_number(const std::string& name, bool top) {
  const auto known = top ? function_numbers_.end() : function_numbers_.find(name);
  if (known != function_numbers_.end() && known->second != kNotYetMet) return known->second;
  code_.functions.emplace_back();
  const int number = static_cast<int>(code_.functions.size()) - 1;
  if (known != function_numbers_.end()) known->second = number;
  return number;
}

int CodeWriter::called_number(const std::string& function) {
  return function_numbers_.contains(function) ? function_number(function, false) : code_.function_numbers.at(function);
}

int CodeWriter::end_function() {
  if (in_statement_line()) {
    emit(Op::kEndStatement);
  } else {
    constant({});
    emit(Op::kReturn);
  }
  const int number = scopes_.back().number;
  code_.functions[static_cast<std::size_t>(number)] = std::move(scopes_.back().function);
  scopes_.pop_back();
  return number;
}

int CodeWriter::emit_at(const Token& where, Op op, int a, int b) {
  std::vector<Instruction>& instructions = scopes_.back().function.instructions;
  if (++written_ > kInstructionsMax) tokens_.fail({where.line, where.column, "compile_error_program_too_large:"});
  instructions.push_back({op, a, b, where.line, where.column});
  return static_cast<int>(instructions.size()) - 1;
}

void CodeWriter::constant(Value value) {
  code_.constants.push_back(std::move(value));
  emit(Op::kConstant, static_cast<int>(code_.constants.size()) - 1);
}

void CodeWriter::load(const Token& name) {
  const Scope& scope = scopes_.back();
  if (const auto own = scope.locals.find(name.text); own != scope.locals.end()) {
    emit_at(name, Op::kLoadLocal, own->second);
  } else if (const auto shared = code_.global_numbers.find(name.text); shared != code_.global_numbers.end()) {
    emit_at(name, Op::kLoadGlobal, shared->second);
  } else {
    fail_name(name);
  }
}

void CodeWriter::store(const Token& name, bool global, bool local) {
  const Scope& scope = scopes_.back();
  const bool shared = code_.global_numbers.contains(name.text);
  const bool own = scope.locals.contains(name.text);
  if (global || (shared && !own && !(local && !scope.top))) {
    emit_at(name, Op::kStoreGlobal, code_.global_numbers[name.text]);
  } else if (in_statement_line() && !own) {
    declare_global(name.text);  // the frame is another function's: it has no room for more
    emit_at(name, Op::kStoreGlobal, code_.global_numbers[name.text]);
  } else {
    emit_at(name, Op::kStoreLocal, declare_local(name.text));
  }
}

int CodeWriter::slot_of(const Token& name, bool global, bool local) {
  const Scope& scope = scopes_.back();
  const bool shared = code_.global_numbers.contains(name.text);
  if (local && shared && !scope.top && !scope.locals.contains(name.text)) {
    load(name);
    store(name, false, true);  // a copy of its own
  }
  if (const auto own = scope.locals.find(name.text); own != scope.locals.end() && !global) return own->second;
  if (shared) return ~code_.global_numbers[name.text];
  fail_name(name);
  return 0;
}

void CodeWriter::fail_name(const Token& name) {
  tokens_.fail({name.line, name.column, fmt::format("compile_error_name_not_found:{}:", name.text)});
}

void CodeWriter::aim(int instruction) {
  scopes_.back().function.instructions[static_cast<std::size_t>(instruction)].a = here();
}

std::vector<Instruction> CodeWriter::cut(int begin) {
  std::vector<Instruction>& instructions = scopes_.back().function.instructions;
  std::vector<Instruction> taken(instructions.begin() + begin, instructions.end());
  instructions.resize(static_cast<std::size_t>(begin));
  for (Instruction& i : taken) {
    if (jumps(i)) i.a -= begin;
  }
  return taken;
}

void CodeWriter::append(const std::vector<Instruction>& instructions) {
  const int begin = here();
  for (Instruction i : instructions) {
    if (jumps(i)) i.a += begin;
    scopes_.back().function.instructions.push_back(i);
  }
}

void CodeWriter::begin_loop() { scopes_.back().loops.push_back({here(), {}}); }

void CodeWriter::end_loop() {
  emit(Op::kJump, scopes_.back().loops.back().begin);
  for (const int exit : scopes_.back().loops.back().exits) aim(exit);
  scopes_.back().loops.pop_back();
}

bool CodeWriter::leave_loop() {
  if (scopes_.back().loops.empty()) return false;
  scopes_.back().loops.back().exits.push_back(emit(Op::kJump));
  return true;
}

bool CodeWriter::repeat_loop() {
  if (scopes_.back().loops.empty()) return false;
  emit(Op::kJump, scopes_.back().loops.back().begin);
  return true;
}

}  // namespace firstlook::sim::ur::script
