#include "hal/sim/ur_controller/script/interpreter_mode.hpp"

#include <climits>
#include <utility>

namespace firstlook::sim::ur::script {
namespace {

// UR says that there is a limit, not which; makers of controllers after its model write 8500.
constexpr int kStatementsMax = 8500;
constexpr std::size_t kStatementBytesMax = 1 << 20;

}  // namespace

void InterpreterMode::enter(int scope, bool clear_queue, bool clear_on_end, const Code& code) {
  active_ = true;
  ending_ = clearing_ = clear_comes_ = false;
  clear_on_end_ = clear_on_end;
  clear_queue_ = clear_queue;
  scope_ = scope;
  kept_ += std::exchange(taken_, 0);
  kept_bytes_ += std::exchange(taken_bytes_, 0);
  before_ = mark_of(code);
}

void InterpreterMode::clean(Code& code) {
  take_back(code, before_);
  waiting_.clear();
  ids_.cleared = ids_.interpreted;
  clearing_ = clear_comes_ = false;
  taken_ = 0;
  taken_bytes_ = 0;
}

bool InterpreterMode::leaves() {
  if (!ending_) return false;
  waiting_.clear();
  active_ = ending_ = clear_comes_ = false;
  return true;
}

std::optional<int> InterpreterMode::begin_next() {
  if (waiting_.empty()) {
    clear_comes_ = false;  // it was called in a branch that was not taken
    return std::nullopt;
  }
  const Statement next = waiting_.front();
  waiting_.pop_front();
  ids_.executed = next.id;
  return next.function;
}

bool InterpreterMode::full() const {
  return kept_ + taken_ >= kStatementsMax || kept_bytes_ + taken_bytes_ >= kStatementBytesMax;
}

std::expected<int, ScriptError> InterpreterMode::add(std::string_view line, Code& code) {
  const auto compiled = compile_statements(line, code, scope_);
  if (!compiled) return std::unexpected(compiled.error());
  ++taken_;
  taken_bytes_ += line.size();
  ids_.interpreted = ids_.interpreted == INT_MAX ? 1 : ids_.interpreted + 1;
  waiting_.push_back({ids_.interpreted, compiled->function});
  clear_comes_ = compiled->clears;
  return ids_.interpreted;
}

void InterpreterMode::skip() {
  if (!waiting_.empty()) clear_comes_ = false;
  waiting_.clear();
}

}  // namespace firstlook::sim::ur::script
