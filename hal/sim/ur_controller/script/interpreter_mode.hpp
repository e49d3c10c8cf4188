/// Interpreter mode of one program (e-Series): the statements that came to it, in the order of their ids, and what
/// becomes of them. UR's script manual, chapter "Interpreter Mode".
#pragma once

#include <deque>
#include <expected>
#include <optional>
#include <string_view>
#include <utility>

#include "hal/sim/ur_controller/script/code.hpp"
#include "hal/sim/ur_controller/script/compiler.hpp"

namespace firstlook::sim::ur::script {

/// The ids that the state commands answer; 0 where there is none yet.
struct StatementIds {
  int interpreted = 0;  ///< the last that was compiled into the program
  int executed = 0;     ///< the last that has begun
  int cleared = 0;      ///< the last that is no longer in it
};

class InterpreterMode {
 public:
  // The program's side.
  /// @param scope  the function that calls interpreter_mode(): statements see its variables
  void enter(int scope, bool clear_queue, bool clear_on_end, const Code& code);
  [[nodiscard]] bool active() const { return active_; }
  /// Both take effect when the statement that runs is over.
  void end() { ending_ = active_; }
  void clear() { clearing_ = active_; }

  // Between two statements, in this order.
  [[nodiscard]] bool cleans() const { return clearing_ || (ending_ && clear_on_end_); }
  /// The statements are no longer part of the code.
  void clean(Code& code);
  /// True when the program goes on behind interpreter_mode().
  [[nodiscard]] bool leaves();
  /// The function to be run next, if there is one.
  [[nodiscard]] std::optional<int> begin_next();

  // The port's side.
  /// Statements are taken now. Not while a clear_interpreter() is on its way: they have to wait.
  [[nodiscard]] bool takes() const { return active_ && !ending_ && !clearing_ && !clear_comes_; }
  /// More were taken than it may hold: clear_interpreter() makes room.
  [[nodiscard]] bool full() const;
  /// Compiles a line into the code; its id.
  [[nodiscard]] std::expected<int, ScriptError> add(std::string_view line, Code& code);
  /// Forgets those that have not begun.
  void skip();
  [[nodiscard]] int unexecuted() const { return static_cast<int>(waiting_.size()); }
  [[nodiscard]] const StatementIds& ids() const { return ids_; }
  /// interpreter_mode() was called and wants the lines gone that were sent before. Asked once.
  [[nodiscard]] bool take_clear_queue() { return std::exchange(clear_queue_, false); }

 private:
  struct Statement {
    int id = 0, function = 0;
  };

  bool active_ = false, ending_ = false, clearing_ = false;
  bool clear_on_end_ = true, clear_queue_ = false;
  bool clear_comes_ = false;  ///< the last statement calls clear_interpreter()
  int scope_ = 0;
  int taken_ = 0;  ///< since it was entered or cleared
  std::size_t taken_bytes_ = 0;
  int kept_ = 0;  ///< from earlier modes of the program, which left them in it
  std::size_t kept_bytes_ = 0;
  CodeMark before_;
  std::deque<Statement> waiting_;
  StatementIds ids_;
};

}  // namespace firstlook::sim::ur::script
