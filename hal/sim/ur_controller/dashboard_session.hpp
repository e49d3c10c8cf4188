/// A client of the dashboard server (29999): one line in, one line out.
#pragma once

#include "hal/sim/ur_controller/programs.hpp"
#include "hal/sim/ur_controller/session.hpp"

namespace firstlook::sim::ur {

/// What the dashboard keeps for all its clients.
struct DashboardState {
  std::string popup;  ///< shown on the pendant; empty: none
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

 private:
  void answer(std::string_view line);

  Controller& controller_;
  Programs& programs_;
  DashboardState& dashboard_;
  std::string received_;
};

}  // namespace firstlook::sim::ur
