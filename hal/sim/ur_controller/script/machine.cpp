#include "hal/sim/ur_controller/script/machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/script/matrices.hpp"
#include "hal/sim/ur_controller/script/places.hpp"

namespace firstlook::sim::ur::script {
namespace {

constexpr int kStepsMax = 5000;   // of one thread in one cycle
constexpr double kBusyMax_s = 2;  // without ever waiting: then the controller says that it is too much behind
constexpr std::uint64_t kMadeMax = 200'000;    // weight of values, of one thread in one cycle
constexpr std::uint64_t kHeldMax = 500'000;    // of the whole program; some 70 bytes each
constexpr std::size_t kProductsForWeight = 4;  // as much work as to make a value of weight 1
constexpr std::string_view kNoValue = "Type error: something without a value is assigned";
constexpr std::size_t kFramesMax = 200;
constexpr std::size_t kStackMax = 10'000;
constexpr std::size_t kThreadsMax = 64;

Value pop(Thread& thread) {
  Value value = std::move(thread.stack.back());
  thread.stack.pop_back();
  return value;
}

}  // namespace

Machine::Machine(Code code, Controller& controller, Sockets* sockets)
    : code_(std::move(code)), controller_(controller), sockets_(sockets), globals_(code_.globals.size()) {
  Thread main;
  main.number = next_thread_++;
  main.frames.push_back({code_.main, 0, 0});
  main.stack.resize(code_.functions[static_cast<std::size_t>(code_.main)].locals.size());
  threads_.push_back(std::move(main));
}

Machine::~Machine() {
  if (sockets_ == nullptr) return;
  for (const auto& [name, socket] : socket_names_) {
    if (socket != 0) sockets_->close(socket);
  }
}

double Machine::now_s() const { return static_cast<double>(cycles_) / controller_.identity().frequency_hz(); }

void Machine::fail(const Instruction& at, std::string text) {
  error_ = ScriptError{at.line, at.column, std::move(text)};
  end_ = End::kFailed;
}

Thread* Machine::find(std::int64_t number) {
  const auto found = std::ranges::find(threads_, number, &Thread::number);
  return found != threads_.end() && !found->frames.empty() ? &*found : nullptr;
}

void Machine::kill(std::int64_t number) {
  if (Thread* thread = find(number)) thread->frames.clear();
  if (arm_owner_ == number) {
    arm_owner_ = 0;
    static_cast<void>(controller_.motion().stop(10));
  }
  if (critical_owner_ == number) critical_owner_ = 0;
}

bool Machine::take_arm(const Thread& thread) {
  if (code_.secondary || (arm_owner_ != 0 && arm_owner_ != thread.number && find(arm_owner_) != nullptr)) return false;
  arm_owner_ = thread.number;
  if (!thread.frames.empty()) {
    const Frame& frame = thread.frames.back();
    const auto& instructions = code_.functions[static_cast<std::size_t>(frame.function)].instructions;
    controller_.set_script_line(static_cast<std::uint32_t>(instructions[frame.next].line));
  }
  return true;
}

std::string Machine::no_value_yet(int slot) const {
  return fmt::format("{} has no value yet", slot < 0 ? code_.globals[static_cast<std::size_t>(~slot)] : "A variable");
}

void Machine::charge_for(const Value& container) { made_ += container.weight / 16; }

Value& Machine::variable(Thread& thread, int slot) {
  if (slot < 0) return globals_[static_cast<std::size_t>(~slot)];
  return thread.stack[thread.frames.back().base + static_cast<std::size_t>(slot)];
}

void Machine::release_arm(const Thread& thread) {
  if (arm_owner_ != thread.number) return;
  arm_owner_ = 0;
  controller_.set_script_line(0);
}

void Machine::step() {
  if (end_) return;
  ++cycles_;
  // Threads that others start in this cycle run in it, too; references into the vector would not survive that.
  for (std::size_t i = 0; i < threads_.size() && !end_; ++i) {
    if (excluded(threads_[i])) continue;
    Thread thread = std::move(threads_[i]);
    threads_[i].number = thread.number;
    threads_[i].frames = {Frame{}};  // it is alive for those who look
    run(thread);
    const bool killed = threads_[i].frames.empty();
    threads_[i] = std::move(thread);
    if (killed) threads_[i].frames.clear();
  }
  // A path that would have blended with the next one goes to its end.
  const bool underway = !code_.secondary && controller_.motion().blending();
  if (!end_ && threads_.front().frames.empty() && !underway) end_ = End::kFinished;
  remove_ended();
  if (!end_ && held() > kHeldMax) fail({}, "Out of memory");
}

std::uint64_t Machine::held() const {
  std::uint64_t sum = 0;
  for (const Value& value : globals_) sum += value.weight;
  for (const Thread& thread : threads_) {
    for (const Value& value : thread.stack) sum += value.weight;
  }
  return sum;
}

/// A critical section keeps the others out while its thread computes, not while it waits: that would stop them for good
/// where a loop enters it again at once.
bool Machine::excluded(const Thread& thread) {
  if (critical_owner_ == 0 || critical_owner_ == thread.number) return false;
  const Thread* owner = find(critical_owner_);
  return owner != nullptr && !owner->waiting;
}

void Machine::remove_ended() {
  for (const Thread& thread : threads_) {
    if (!thread.frames.empty()) continue;
    if (critical_owner_ == thread.number) critical_owner_ = 0;
    if (arm_owner_ == thread.number) release_arm(thread);
  }
  for (std::size_t i = threads_.size(); i-- > 1;) {
    if (threads_[i].frames.empty()) threads_.erase(threads_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

void Machine::run(Thread& thread) {
  thread.waiting = false;
  made_ = 0;
  for (int steps = 0; steps < kStepsMax && made_ < kMadeMax; ++steps) {
    if (end_ || thread.frames.empty()) return;
    if (!execute(thread)) {
      if (thread.waiting) thread.busy_cycles = 0;
      return;
    }
  }
  if (++thread.busy_cycles * cycle_s() > kBusyMax_s) {
    const Frame& frame = thread.frames.back();
    fail(code_.functions[static_cast<std::size_t>(frame.function)].instructions[frame.next],
         "Runtime is too much behind: a loop takes no time");
  }
}

bool Machine::execute_call(Thread& thread, const Instruction& instruction) {
  const Function& function = code_.functions[static_cast<std::size_t>(instruction.a)];
  if (thread.frames.size() >= kFramesMax || thread.stack.size() >= kStackMax) {
    return fail(instruction, "Stack overflow"), false;
  }
  const auto count = static_cast<std::size_t>(instruction.b);
  ++thread.frames.back().next;
  thread.frames.push_back({instruction.a, 0, thread.stack.size() - count});
  thread.stack.resize(thread.stack.size() - count + function.locals.size());
  return true;
}

bool Machine::execute_builtin(Thread& thread, const Instruction& instruction) {
  const auto count = static_cast<std::size_t>(instruction.b);
  Call call(*this, thread, std::span<const Value>(thread.stack).last(count));
  builtin(instruction.a).run(call);
  if (!call.ok()) return fail(instruction, call.error()), false;
  thread.call.first = false;
  if (end_) return false;
  if (call.waits()) {
    thread.waiting = true;
    return false;
  }
  thread.call = {};
  if (const auto excess = call.answer().excess(); !excess.empty()) return fail(instruction, std::string(excess)), false;
  made_ += call.answer().weight;
  Value answer = std::move(call.answer());
  thread.stack.resize(thread.stack.size() - count);
  thread.stack.push_back(std::move(answer));
  ++thread.frames.back().next;
  return true;
}

bool Machine::execute_thread_op(Thread& thread, const Instruction& instruction) {
  if (instruction.op == Op::kRun) {
    const Function& function = code_.functions[static_cast<std::size_t>(instruction.a)];
    if (threads_.size() >= kThreadsMax) return fail(instruction, "Too many threads"), false;
    Thread started;
    started.number = next_thread_++;
    started.interpreted = thread.interpreted || (interpreter_.active() && thread.number == kMainThread);
    started.frames.push_back({instruction.a, 0, 0});
    started.stack.resize(function.locals.size());
    thread.stack.emplace_back(ThreadHandle{started.number});
    threads_.push_back(std::move(started));
    ++thread.frames.back().next;
    return true;
  }
  // Scripts keep 0 in a variable for "no thread": nothing to join or kill.
  const auto* handle = thread.stack.back().as<ThreadHandle>();
  const std::int64_t number = handle != nullptr ? handle->number : 0;
  if (instruction.op == Op::kJoin && number != thread.number && find(number) != nullptr) {
    thread.waiting = true;
    return false;
  }
  thread.stack.pop_back();
  ++thread.frames.back().next;
  if (instruction.op == Op::kKill) {
    if (number == thread.number) {
      thread.frames.clear();
      return false;
    }
    kill(number);
  }
  return true;
}

bool Machine::execute(Thread& thread) {
  Frame& frame = thread.frames.back();
  const Instruction instruction = code_.functions[static_cast<std::size_t>(frame.function)].instructions[frame.next];
  std::vector<Value>& stack = thread.stack;
  const auto a = static_cast<std::size_t>(instruction.a);
  const auto put = [&](Computed result) {
    if (!result) return fail(instruction, std::move(result.error())), false;
    if (const auto excess = result->excess(); !excess.empty()) return fail(instruction, std::string(excess)), false;
    made_ += result->weight;
    stack.push_back(std::move(*result));
    return true;
  };
  const auto load = [&](const Value& value, std::string_view name) {
    if (value.empty()) return fail(instruction, fmt::format("{} has no value yet", name)), false;
    made_ += value.weight;
    stack.push_back(value);
    return true;
  };
  // A function without a value may be called, but not assigned or compared.
  const auto condition = [&](const Value& value) -> std::optional<bool> {
    if (const bool* flag = value.as<bool>()) return *flag;
    if (value.is_number()) return value.number() != 0;
    fail(instruction, fmt::format("Type error: a condition is {}, not bool", type_name(value)));
    return std::nullopt;
  };
  if (stack.size() > kStackMax) return fail(instruction, "Stack overflow"), false;

  switch (instruction.op) {
    case Op::kCall:
      return execute_call(thread, instruction);
    case Op::kCallBuiltin:
      return execute_builtin(thread, instruction);
    case Op::kRun:
    case Op::kJoin:
    case Op::kKill:
      return execute_thread_op(thread, instruction);
    case Op::kInterpret:
      return execute_interpret(thread);
    case Op::kEndStatement:
      thread.frames.pop_back();
      return true;
    case Op::kReturn: {
      Value value = pop(thread);
      stack.resize(frame.base);
      thread.frames.pop_back();
      if (thread.frames.empty()) return false;
      stack.push_back(std::move(value));
      return true;
    }
    case Op::kJump:
      // Backwards only from a loop's end.
      frame.next = a;
      return true;
    case Op::kJumpIfSet:
      frame.next = stack[frame.base + static_cast<std::size_t>(instruction.b)].empty() ? frame.next + 1 : a;
      return true;
    case Op::kJumpIfFalse:
    case Op::kJumpIfFalseKeep:
    case Op::kJumpIfTrueKeep: {
      const std::optional<bool> truth = condition(stack.back());
      if (!truth) return false;
      const bool jumps = instruction.op == Op::kJumpIfTrueKeep ? *truth : !*truth;
      if (instruction.op == Op::kJumpIfFalse || !jumps) stack.pop_back();
      frame.next = jumps ? a : frame.next + 1;
      return true;
    }
    default:
      break;
  }

  ++frame.next;
  switch (instruction.op) {
    case Op::kConstant:
      made_ += code_.constants[a].weight - 1;
      stack.push_back(code_.constants[a]);
      return true;
    case Op::kLoadLocal:
      return load(Value(stack[frame.base + a]), "A variable");
    case Op::kLoadGlobal:
      return load(globals_[a], code_.globals[a]);
    case Op::kStoreLocal:
    case Op::kStoreGlobal: {
      Value value = pop(thread);
      if (value.empty()) return fail(instruction, std::string(kNoValue)), false;
      Value& variable = instruction.op == Op::kStoreLocal ? stack[frame.base + a] : globals_[a];
      variable = assigned(variable, std::move(value));
      return true;
    }
    case Op::kIndex: {
      Computed element = element_of(stack[stack.size() - 1 - a], std::span<const Value>(stack).last(a));
      stack.resize(stack.size() - 1 - a);
      return put(std::move(element));
    }
    case Op::kSetElement: {
      Value& container = variable(thread, instruction.b);
      if (container.empty()) return fail(instruction, no_value_yet(instruction.b)), false;
      if (stack.back().empty()) return fail(instruction, std::string(kNoValue)), false;
      made_ += stack.back().weight;
      charge_for(container);
      const Computed done = set_element(container, std::span<const Value>(stack).last(a + 1).first(a), stack.back());
      if (!done) return fail(instruction, done.error()), false;
      if (const auto excess = container.excess(); !excess.empty()) return fail(instruction, std::string(excess)), false;
      stack.resize(stack.size() - a - 1);
      return true;
    }
    case Op::kNegate:
      return put(negate(pop(thread)));
    case Op::kNot: {
      const std::optional<bool> truth = condition(stack.back());
      if (!truth) return false;
      stack.back() = Value(!*truth);
      return true;
    }
    case Op::kBinary: {
      const Value b = pop(thread);
      const Value c = pop(thread);
      charge(products_of(c, b) / kProductsForWeight);
      return put(binary(static_cast<BinaryOp>(instruction.a), c, b));
    }
    case Op::kPop:
      stack.pop_back();
      return true;
    case Op::kMakeList: {
      for (std::size_t i = stack.size() - a; i < stack.size(); ++i) {
        if (stack[i].empty())
          return fail(instruction, "Type error: something without a value is put into a list"), false;
      }
      List list(std::make_move_iterator(stack.end() - instruction.a), std::make_move_iterator(stack.end()));
      stack.resize(stack.size() - a);
      return put(Value(std::move(list)));
    }
    case Op::kMakePose: {
      PoseValue pose;
      for (std::size_t i = 0; i < 6; ++i) {
        const Value& value = stack[stack.size() - 6 + i];
        if (!value.is_number()) return fail(instruction, "Type error: a pose has six numbers"), false;
        pose.pose[i] = value.number();
      }
      stack.resize(stack.size() - 6);
      stack.emplace_back(pose);
      return true;
    }
    case Op::kEnterCritical:
      critical_owner_ = thread.number;
      return true;
    case Op::kExitCritical:
      critical_owner_ = 0;
      return true;
    default:
      halt();
      return false;
  }
}

}  // namespace firstlook::sim::ur::script
