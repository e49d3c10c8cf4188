#include "hal/sim/ur_controller/simulated_ur.hpp"

#include "hal/sim/ur_controller/happenings_session.hpp"
#include "hal/sim/ur_controller/interpreter_session.hpp"
#include "hal/sim/ur_controller/primary_packets.hpp"
#include "hal/sim/ur_controller/truth_session.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook::sim::ur {

std::string_view name_of(Port port) {
  switch (port) {
    case Port::kDashboard:
      return "dashboard";
    case Port::kPrimary:
      return "primary";
    case Port::kSecondary:
      return "secondary";
    case Port::kRealtime:
      return "realtime";
    case Port::kRtde:
      return "RTDE";
    case Port::kPrimaryReadOnly:
      return "primary, read-only";
    case Port::kSecondaryReadOnly:
      return "secondary, read-only";
    case Port::kRealtimeReadOnly:
      return "realtime, read-only";
    case Port::kInterpreter:
      return "interpreter";
    case Port::kHappenings:
      return "what people and mishaps do to it";
    case Port::kTruth:
      return "true joints, for simulated cameras";
  }
  return "";
}

SimulatedUr::SimulatedUr(const ControllerIdentity& identity, const SimulatedUrOptions& options)
    : controller_(identity), programs_(controller_, options.programs) {
  dashboard_.remote_control = options.remote_control;
  if (options.start_rad) controller_.place(*options.start_rad);
  controller_.set_encoders(options.encoder_sigma_rad, options.encoder_seed);
  if (!options.running) return;
  controller_.release_brakes();
  while (controller_.state().robot_mode != RobotMode::kRunning) controller_.step();
}

void SimulatedUr::step() {
  controller_.step();
  programs_.step();
  for (const ControllerEvent& event : controller_.events().take()) {
    const std::string message = event_message(event);
    for (StateSession* listener : event_listeners_) listener->on_event(message);
  }
  for (const std::unique_ptr<Session>& session : sessions_) session->on_cycle();
}

void SimulatedUr::reboot() {
  programs_.forget();
  const bool remote_control = dashboard_.remote_control;
  dashboard_ = {};
  dashboard_.remote_control = remote_control;
  for (const std::unique_ptr<Session>& session : sessions_) {
    if (!session->is_private()) session->cut_off();
  }
  controller_.reboot();
}

bool SimulatedUr::has(Port port) const {
  return port != Port::kInterpreter || controller_.identity().series == Series::kESeries;
}

bool SimulatedUr::serves(Port port) const {
  return has(port) && (!controller_.booting() || port == Port::kTruth || port == Port::kHappenings);
}

Session& SimulatedUr::open(Port port) {
  const auto state_session = [&](bool read_only, bool primary) {
    auto session = std::make_unique<StateSession>(controller_, programs_, read_only, primary);
    event_listeners_.push_back(session.get());
    return session;
  };
  std::unique_ptr<Session> session;
  switch (port) {
    case Port::kDashboard:
      session = std::make_unique<DashboardSession>(controller_, programs_, dashboard_);
      break;
    case Port::kPrimary:
    case Port::kPrimaryReadOnly:
      session = state_session(port == Port::kPrimaryReadOnly, true);
      break;
    case Port::kSecondary:
    case Port::kSecondaryReadOnly:
      session = state_session(port == Port::kSecondaryReadOnly, false);
      break;
    case Port::kRealtime:
    case Port::kRealtimeReadOnly:
      session = std::make_unique<RealtimeSession>(controller_, programs_, port == Port::kRealtimeReadOnly);
      break;
    case Port::kRtde:
      session = std::make_unique<RtdeSession>(controller_, owners_);
      break;
    case Port::kInterpreter:
      session = std::make_unique<InterpreterSession>(programs_);
      break;
    case Port::kHappenings:
      session = std::make_unique<HappeningsSession>(*this);
      break;
    case Port::kTruth:
      session = std::make_unique<TruthSession>(controller_);
      break;
  }
  ENSURE(5101, session != nullptr);
  sessions_.push_back(std::move(session));
  return *sessions_.back();
}

void SimulatedUr::close(Session& session) {
  session.closed();
  std::erase_if(event_listeners_, [&](const StateSession* listener) { return listener == &session; });
  std::erase_if(sessions_, [&](const std::unique_ptr<Session>& held) { return held.get() == &session; });
}

}  // namespace firstlook::sim::ur
