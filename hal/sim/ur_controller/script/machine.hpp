/// Runs a compiled script, one control cycle at a time, within bounds on steps and memory.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hal/sim/ur_controller/controller.hpp"
#include "hal/sim/ur_controller/script/code.hpp"
#include "hal/sim/ur_controller/script/interpreter_mode.hpp"
#include "hal/sim/ur_controller/script/lexer.hpp"
#include "hal/sim/ur_controller/script/sockets.hpp"

namespace firstlook::sim::ur::script {

/// What a builtin that takes time keeps between cycles.
struct CallState {
  bool first = true;
  int phase = 0;
  double until_s = 0;
  std::uint64_t ticket = 0;
  std::string rpc_url;  ///< of the server that is being called
};

struct Frame {
  int function = 0;
  std::size_t next = 0;  ///< instruction
  std::size_t base = 0;  ///< of its locals in the stack
};

struct Thread {
  std::int64_t number = 0;
  std::vector<Frame> frames;
  std::vector<Value> stack;
  CallState call;
  bool waiting = false;      ///< ended its cycle in a builtin, or in a join
  bool interpreted = false;  ///< begun by a statement of the interpreter port: ends when that is cleared
  int busy_cycles = 0;       ///< one after the other, without waiting
};

class Machine {
 public:
  enum class End : std::uint8_t { kFinished, kHalted, kFailed };

  /// All must outlive the machine; `sockets` may be null: then no connection can be opened.
  Machine(Code code, Controller& controller, Sockets* sockets);
  ~Machine();
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  /// One cycle. Each thread runs until it waits, or for its steps.
  void step();
  /// Empty while it runs. A program ends with its main function; threads end with it.
  [[nodiscard]] std::optional<End> end() const { return end_; }
  [[nodiscard]] const std::optional<ScriptError>& error() const { return error_; }
  [[nodiscard]] const Code& code() const { return code_; }

  // For the interpreter port, between two cycles.
  [[nodiscard]] InterpreterMode& interpreter() { return interpreter_; }
  /// A line for interpreter mode; its id.
  [[nodiscard]] std::expected<int, ScriptError> interpret(std::string_view line);
  /// A movej or movel that is under way brakes, and is over when the arm stands.
  void abort_path();

  // For builtins.
  [[nodiscard]] Controller& controller() { return controller_; }
  [[nodiscard]] Sockets* sockets() { return sockets_; }
  /// The time that the program has run: it stands still in a pause.
  [[nodiscard]] double now_s() const;
  [[nodiscard]] double cycle_s() const { return controller_.identity().cycle.seconds(); }
  void halt() { end_ = End::kHalted; }
  /// The socket of that name, 0 if there is none.
  [[nodiscard]] std::uint64_t& socket(const std::string& name) { return socket_names_[name]; }
  void forget_socket(const std::string& name) { socket_names_.erase(name); }
  [[nodiscard]] std::size_t open_sockets() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(socket_names_, [](const auto& entry) { return entry.second != 0; }));
  }
  /// Local in the frame that runs, or ~slot of a global; may have no value.
  [[nodiscard]] Value& variable(Thread& thread, int slot);
  [[nodiscard]] std::string no_value_yet(int slot) const;
  /// A place in it is looked for.
  void charge_for(const Value& container);
  /// Work that a thread has done beside making values, in their weight.
  void charge(std::size_t work) { made_ += work; }
  /// False when another thread moves the arm. `line` 0 lets it go.
  [[nodiscard]] bool take_arm(const Thread& thread);
  void release_arm(const Thread& thread);
  /// False where that cannot be: in another thread than the main one, in a secondary program, or nested.
  [[nodiscard]] bool enter_interpreter_mode(const Thread& thread, bool clear_queue, bool clear_on_end);

 private:
  static constexpr std::int64_t kMainThread = 1;

  void run(Thread& thread);
  /// False when the thread waits or is gone.
  [[nodiscard]] bool execute(Thread& thread);
  [[nodiscard]] bool execute_call(Thread& thread, const Instruction& instruction);
  [[nodiscard]] bool execute_builtin(Thread& thread, const Instruction& instruction);
  [[nodiscard]] bool execute_thread_op(Thread& thread, const Instruction& instruction);
  [[nodiscard]] bool execute_interpret(Thread& thread);
  void clear_interpreted();
  void fail(const Instruction& at, std::string text);
  [[nodiscard]] Thread* find(std::int64_t number);
  [[nodiscard]] bool excluded(const Thread& thread);
  /// The weight of everything that it holds.
  [[nodiscard]] std::uint64_t held() const;
  void kill(std::int64_t number);
  void remove_ended();

  Code code_;
  Controller& controller_;
  Sockets* sockets_;
  std::vector<Value> globals_;
  std::vector<Thread> threads_;  ///< the first is the main one
  std::int64_t next_thread_ = kMainThread;
  std::uint64_t cycles_ = 0;
  std::uint64_t made_ = 0;  ///< weight of the values that were made for one thread in this cycle
  std::int64_t arm_owner_ = 0, critical_owner_ = 0;
  InterpreterMode interpreter_;
  std::map<std::string, std::uint64_t> socket_names_;
  std::optional<End> end_;
  std::optional<ScriptError> error_;
};

}  // namespace firstlook::sim::ur::script
