/// Lines that clients send to the interpreter port, until the running program takes them, and what they are answered.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <string_view>

#include "hal/sim/ur_controller/script/machine.hpp"

namespace firstlook::sim::ur {

/// Where the answers to a client are put, line by line; it may be gone before they come.
using Mailbox = std::shared_ptr<std::string>;

class StatementQueue {
 public:
  /// A line without its end. Commands are carried out and answered at once; statements when the program has compiled
  /// them, which it does as soon as it is in interpreter mode.
  /// @param program  the one that runs; null: none does
  void receive(std::string_view line, const Mailbox& to, script::Machine* program);
  /// After each cycle of the program, and after its end.
  void step(script::Machine* program);

  // For the table of commands.
  void skip(script::Machine& program);
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }

 private:
  struct Line {
    std::string text;
    Mailbox to;
  };

  void interpret(const Line& line, script::Machine& program);
  void discard_all(std::string_view reason);

  std::deque<Line> waiting_;
  std::size_t waiting_bytes_ = 0;
};

}  // namespace firstlook::sim::ur
