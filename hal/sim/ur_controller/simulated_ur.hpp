/// A whole simulated UR controller: the robot, its program, and a session for each connection to each of its ports.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "hal/sim/ur_controller/dashboard_session.hpp"
#include "hal/sim/ur_controller/rtde_session.hpp"
#include "hal/sim/ur_controller/stream_sessions.hpp"

namespace firstlook::sim::ur {

enum class Port : std::uint16_t {
  kDashboard = 29999,
  kPrimary = 30001,
  kSecondary = 30002,
  kRealtime = 30003,
  kRtde = 30004,
  kPrimaryReadOnly = 30011,
  kSecondaryReadOnly = 30012,
  kRealtimeReadOnly = 30013,
  kInterpreter = 30020,  ///< e-Series only
  kHappenings = 30098,   ///< private: happenings.hpp
  kTruth = 30099,        ///< private: truth_session.hpp
};
/// What controllers serve.
inline constexpr std::array kPorts = {
    Port::kDashboard,       Port::kPrimary,           Port::kSecondary,        Port::kRealtime,   Port::kRtde,
    Port::kPrimaryReadOnly, Port::kSecondaryReadOnly, Port::kRealtimeReadOnly, Port::kInterpreter};
/// "dashboard", "primary", ...
[[nodiscard]] std::string_view name_of(Port port);

struct SimulatedUrOptions {
  std::vector<StoredProgram> programs;     ///< that `load` finds
  bool running = false;                    ///< starts with the brakes released instead of without power
  std::optional<JointVector> start_rad{};  ///< where the arm stands at first
  double encoder_sigma_rad = 0;            ///< of what is said of the actual joints
  std::uint64_t encoder_seed = 0;
  bool remote_control = true;  ///< what an e-Series answers; it takes the network's Play in both
};

class SimulatedUr {
 public:
  SimulatedUr(const ControllerIdentity& identity, const SimulatedUrOptions& options);

  /// One control cycle of `cycle()`: robot, program, then what is due on every session.
  void step();
  [[nodiscard]] Duration cycle() const { return controller_.identity().cycle; }

  /// The controller's computer is switched off and on: every connection and program ends, and for some seconds nobody
  /// answers.
  void reboot();
  /// Controllers of its generation have this port.
  [[nodiscard]] bool has(Port port) const;
  /// False while it boots, too: no port is there but the private ones.
  [[nodiscard]] bool serves(Port port) const;
  void set_remote_control(bool on) { dashboard_.remote_control = on; }
  /// The cable of its network: whoever carries its bytes carries none while it is out.
  void plug(bool in) { cable_in_ = in; }
  [[nodiscard]] bool cable_in() const { return cable_in_; }

  /// A client connects. The session lives until `close`.
  [[nodiscard]] Session& open(Port port);
  void close(Session& session);

  [[nodiscard]] Controller& controller() { return controller_; }
  [[nodiscard]] Programs& programs() { return programs_; }
  /// A client has sent `shutdown`.
  [[nodiscard]] bool shutting_down() const { return dashboard_.shutting_down; }

 private:
  Controller controller_;
  Programs programs_;
  DashboardState dashboard_;
  bool cable_in_ = true;
  RtdeInputOwners owners_;
  std::vector<std::unique_ptr<Session>> sessions_;
  std::vector<StateSession*> event_listeners_;
};

}  // namespace firstlook::sim::ur
