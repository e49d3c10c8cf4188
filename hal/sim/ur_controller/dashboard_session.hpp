/// A client of the dashboard server (29999): one line in, one line out.
#pragma once

#include <optional>
#include <string>

#include "hal/sim/ur_controller/programs.hpp"
#include "hal/sim/ur_controller/session.hpp"

namespace firstlook::sim::ur {

/// What the dashboard keeps for all its clients.
struct DashboardState {
  std::string operational_mode = "NONE";
  std::string user_role = "PROGRAMMER";
  int flight_reports = 0;
  bool remote_control = true;
  bool shutting_down = false;
};

class DashboardSession final : public Session {
 public:
  /// All must outlive the session. Greets.
  DashboardSession(Controller& controller, Programs& programs, DashboardState& dashboard);

  void receive(std::string_view bytes) override;

  // For the table of commands.
  [[nodiscard]] Controller& controller() { return controller_; }
  [[nodiscard]] Programs& programs() { return programs_; }
  [[nodiscard]] DashboardState& dashboard() { return dashboard_; }
  void disconnect() { end(); }
  /// A command whose reply comes when it has been carried out: asked each cycle, until it has one. Lines that come
  /// meanwhile wait.
  using Reply = std::optional<std::string> (*)(DashboardSession& session);
  void answer_when(Reply reply) { pending_ = reply; }

  void on_cycle() override;

 private:
  void answer_lines();
  void answer(std::string_view line);

  Controller& controller_;
  Programs& programs_;
  DashboardState& dashboard_;
  std::string received_;
  Reply pending_ = nullptr;
};

}  // namespace firstlook::sim::ur
