/// A client of the private port for happenings (30098): one line of words in, one line out, as on the dashboard.
#pragma once

#include "hal/sim/ur_controller/session.hpp"

namespace firstlook::sim::ur {

class SimulatedUr;

class HappeningsSession final : public Session {
 public:
  /// The robot must outlive the session. Greets.
  explicit HappeningsSession(SimulatedUr& robot);
  void receive(std::string_view bytes) override;
  [[nodiscard]] bool is_private() const override { return true; }

 private:
  SimulatedUr& robot_;
  std::string received_;
};

/// What one line does to a robot, and the answer to it: "done", or what is wrong; "help" for all words.
[[nodiscard]] std::string answer_happening(std::string_view line, SimulatedUr& robot);

}  // namespace firstlook::sim::ur
