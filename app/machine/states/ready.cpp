/// Ready: nothing moves until a person asks for it (safety rule 6).
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {
constexpr double kPressWithin_s = 60;  // of Play, safety rule 6
}

void enter_ready(Machine& m) {
  m.light(hal::Light::kGreen);
  if (m.finished()) return;
  const bool stored = m.settings().scope == RunScope::kMap || m.settings().scope == RunScope::kVerify;
  m.show("ready: {}", stored ? "Play tests the stored calibration" : "press Play on the pendant");
}

Handled on_ready(Machine& m, const MachineEvent& event) {
  Progress& p = m.progress();
  if (const auto* key = std::get_if<OperatorActed>(&event)) {
    const bool play = key->action == hal::OperatorAction::kPlay;
    if (key->device == OperatorDevice::kPendant) {
      p.played = play;
      p.played_at = m.now();
      if (play && m.settings().start_source == StartSource::kPanel) m.show("press the start button");
    } else if (play && m.settings().start_source == StartSource::kPanel && p.played && m.arm().program_running &&
               m.now() - p.played_at <= seconds(kPressWithin_s)) {
      m.transition(StateId::kLocateBoard);
    }
    return Handled::kYes;
  }
  if (const auto* asked = std::get_if<ShutdownAsked>(&event)) {
    m.stop_for(asked->cause);
    return Handled::kYes;
  }
  if (const auto* report = std::get_if<ArmReported>(&event); report != nullptr && !may_move(report->state.safety)) {
    m.stop_for(Fault::kProtectiveStop);
    return Handled::kYes;
  }
  if (std::holds_alternative<ArmReported>(event) && m.settings().start_source == StartSource::kPendant && p.played &&
      m.arm().program_running) {
    m.transition(StateId::kLocateBoard);
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
