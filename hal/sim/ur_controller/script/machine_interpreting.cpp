// The part of the machine that runs statements of the interpreter port.
#include <algorithm>

#include "hal/sim/ur_controller/script/builtins.hpp"

namespace firstlook::sim::ur::script {
namespace {

constexpr double kAbort_rad_s2 = 10;

}  // namespace

std::expected<int, ScriptError> Machine::interpret(std::string_view line) {
  auto id = interpreter_.add(line, code_);
  globals_.resize(code_.globals.size());
  return id;
}

bool Machine::enter_interpreter_mode(const Thread& thread, bool clear_queue, bool clear_on_end) {
  if (code_.secondary || thread.number != kMainThread || interpreter_.active()) return false;
  interpreter_.enter(thread.frames.back().function, clear_queue, clear_on_end, code_);
  return true;
}

void Machine::clear_interpreted() {
  for (const Thread& thread : threads_) {
    if (thread.interpreted) kill(thread.number);
  }
  interpreter_.clean(code_);
  globals_.resize(code_.globals.size());
}

/// Between two statements of the interpreter port. They run in the frame of the function that has called
/// interpreter_mode(), and so see its variables.
bool Machine::execute_interpret(Thread& thread) {
  if (interpreter_.cleans()) clear_interpreted();
  Frame& frame = thread.frames.back();
  if (interpreter_.leaves()) {
    ++frame.next;
    return true;
  }
  if (const auto function = interpreter_.begin_next()) {
    thread.frames.push_back({*function, 0, frame.base});
    return true;
  }
  thread.waiting = true;
  return false;
}

void Machine::abort_path() {
  const auto owner = std::ranges::find(threads_, arm_owner_, &Thread::number);
  if (owner == threads_.end() || owner->frames.empty() || owner->call.phase == 0) return;
  const Frame& frame = owner->frames.back();
  const Instruction& at = code_.functions[static_cast<std::size_t>(frame.function)].instructions[frame.next];
  const std::string_view name = at.op == Op::kCallBuiltin ? builtin(at.a).name : std::string_view();
  if (name != "movej" && name != "movel") return;
  owner->call.ticket = controller_.motion().stop(kAbort_rad_s2);
}

}  // namespace firstlook::sim::ur::script
