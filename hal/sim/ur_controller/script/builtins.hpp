/// The functions of URScript that the simulated controller has.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "hal/sim/ur_controller/script/machine.hpp"
#include "hal/sim/ur_controller/script/operations.hpp"

namespace firstlook::sim::ur::script {

/// What a builtin is called with, and what it answers. Reading an argument of the wrong type fails the call.
class Call {
 public:
  Call(Machine& machine, Thread& thread, std::span<const Value> arguments)
      : machine_(machine), thread_(thread), arguments_(arguments) {}

  [[nodiscard]] Machine& machine() { return machine_; }
  [[nodiscard]] Controller& controller() { return machine_.controller(); }
  [[nodiscard]] const ControllerState& robot() { return machine_.controller().state(); }
  [[nodiscard]] const Thread& thread() const { return thread_; }
  [[nodiscard]] Value& variable(int slot) { return machine_.variable(thread_, slot); }
  [[nodiscard]] CallState& state() { return thread_.call; }

  [[nodiscard]] const Value& value(std::size_t i) const { return arguments_[i]; }
  [[nodiscard]] std::span<const Value> values() const { return arguments_; }
  [[nodiscard]] double number(std::size_t i);
  [[nodiscard]] std::int64_t integer(std::size_t i);
  /// Within `low` to `high`, both allowed.
  [[nodiscard]] int integer(std::size_t i, int low, int high);
  [[nodiscard]] bool flag(std::size_t i);
  [[nodiscard]] std::string text(std::size_t i);
  /// A list of six numbers, or a pose.
  [[nodiscard]] Vector6 six(std::size_t i);
  [[nodiscard]] Vector3 three(std::size_t i);
  [[nodiscard]] Pose pose(std::size_t i) { return pose_of(six(i)); }
  [[nodiscard]] JointVector joints(std::size_t i);

  void answer(Value value) { answer_ = std::move(value); }
  void answer_or_fail(Computed computed);
  /// To be called again in the next cycle.
  void wait() { waits_ = true; }
  /// For `seconds` from the first call; true when they are over.
  [[nodiscard]] bool waited(double seconds);
  void fail(std::string text) {
    if (error_.empty()) error_ = std::move(text);
  }
  /// Where the value is larger than a program may have.
  void fail_excess(Value& value);
  void fail_type(std::size_t i, std::string_view wanted);

  [[nodiscard]] bool ok() const { return error_.empty(); }
  [[nodiscard]] bool waits() const { return waits_; }
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] Value& answer() { return answer_; }

 private:
  Machine& machine_;
  Thread& thread_;
  std::span<const Value> arguments_;
  Value answer_;
  bool waits_ = false;
  std::string error_;
};

/// A row of the tables of builtins: "q,a=1.4,v=1.05" are the names of its parameters and the defaults of some.
struct Builtin {
  std::string_view name, parameters;
  void (*run)(Call& call);
};

// One table for each subject.
[[nodiscard]] std::span<const Builtin> math_builtins();
[[nodiscard]] std::span<const Builtin> text_builtins();
[[nodiscard]] std::span<const Builtin> motion_builtins();
[[nodiscard]] std::span<const Builtin> robot_builtins();
[[nodiscard]] std::span<const Builtin> io_builtins();
[[nodiscard]] std::span<const Builtin> socket_builtins();
[[nodiscard]] std::span<const Builtin> interpreter_builtins();
[[nodiscard]] std::span<const Builtin> pendant_builtins();
[[nodiscard]] std::span<const Builtin> rpc_builtins();
[[nodiscard]] std::span<const Builtin> object_builtins();

/// A function of another computer; takes its time, as builtins do.
void call_remote(Call& call, const RpcHandle& rpc, const std::string& method, std::span<const Value> arguments);

struct Parameter {
  std::string name;
  bool has_default = false;
  Value default_value;
};

/// Its number, or -1.
[[nodiscard]] int find_builtin(std::string_view name);
[[nodiscard]] const Builtin& builtin(int number);
[[nodiscard]] std::vector<Parameter> parameters_of(int number);

}  // namespace firstlook::sim::ur::script
