/// The program that runs, the one that is loaded, and those that could be: what Play, Pause, Stop and scripts act on.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "hal/sim/ur_controller/controller.hpp"
#include "hal/sim/ur_controller/program_request.hpp"
#include "hal/sim/ur_controller/script/machine.hpp"
#include "hal/sim/ur_controller/statement_queue.hpp"

namespace firstlook::sim::ur {

/// A file on the controller: `load NAME` of the dashboard finds it, with or without the folder before it.
struct StoredProgram {
  std::string name;            ///< "cart.urp"
  std::string script;          ///< URScript, one `def ... end`
  ExternalControl external{};  ///< asked for the script at each Play instead, where it names a port
};

class Programs {
 public:
  /// The controller must outlive this.
  Programs(Controller& controller, std::vector<StoredProgram> stored);

  /// How scripts reach other computers; null: not at all. Must outlive this, or be set to null again.
  void set_sockets(script::Sockets* sockets);

  /// The controller's computer was switched off: nothing runs, nothing is loaded.
  void forget();

  /// One control cycle, after the controller's.
  void step();

  // Each is false when it cannot be done in this mode.
  [[nodiscard]] bool load(std::string_view name);  ///< stops what runs
  [[nodiscard]] bool play();
  [[nodiscard]] bool pause();
  [[nodiscard]] bool stop();

  /// After `play`: its program has not begun yet, or not gone on.
  [[nodiscard]] bool starting() const;
  /// And it never did.
  [[nodiscard]] bool start_failed() const { return start_failed_; }

  /// URScript that came over a script port: it replaces what runs; a `sec` runs beside it. What does not compile leaves
  /// the running program alone and is told as a runtime exception.
  void submit(const std::string& script);

  /// A line that came over the interpreter port.
  void interpret(std::string_view line, const Mailbox& answers_to) {
    statements_.receive(line, answers_to, program_.get());
  }

  /// "/programs/cart.urp", empty when nothing is loaded.
  [[nodiscard]] std::string loaded_path() const;
  /// "cart.urp", or "<unnamed>" as the dashboard calls it when nothing is loaded.
  [[nodiscard]] std::string_view loaded_name() const;

 private:
  [[nodiscard]] bool start(const std::string& script);
  [[nodiscard]] bool start_loaded();
  void follow_request();
  void follow_watchdogs();
  void begin_pending();
  void end_program();
  void drop_program();
  void tell_error(const script::ScriptError& error);

  Controller& controller_;
  std::vector<StoredProgram> stored_;
  script::Sockets* sockets_ = nullptr;
  const StoredProgram* loaded_ = nullptr;
  bool start_failed_ = false;
  std::unique_ptr<ProgramRequest> request_;
  std::unique_ptr<script::Machine> program_;
  std::unique_ptr<script::Machine> pending_;  ///< begins when the arm stands
  std::vector<std::unique_ptr<script::Machine>> secondary_;
  StatementQueue statements_;
};

}  // namespace firstlook::sim::ur
