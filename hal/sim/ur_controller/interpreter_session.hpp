/// A client of the interpreter port (30020): a line of statements or a command in, a line out when it has been taken.
#pragma once

#include "hal/sim/ur_controller/programs.hpp"
#include "hal/sim/ur_controller/session.hpp"

namespace firstlook::sim::ur {

class InterpreterSession final : public Session {
 public:
  /// `programs` must outlive the session.
  explicit InterpreterSession(Programs& programs) : programs_(programs) {}

  void receive(std::string_view bytes) override;
  void on_cycle() override;

 private:
  Programs& programs_;
  std::string received_;
  Mailbox answers_ = std::make_shared<std::string>();
};

}  // namespace firstlook::sim::ur
