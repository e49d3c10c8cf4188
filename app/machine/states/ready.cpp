/// Ready: nothing moves until a person asks for it (safety rule 6).
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {

constexpr double kPressWithin_s = 60;  // of Play, safety rule 6

std::string_view first_absent(const Machine& m) {
  std::size_t device = 0;
  while (!m.absent().test(device)) ++device;
  return name_of(static_cast<CartDevice>(device));
}

/// Green and what to press, or red and what is missing.
void tell_ready(Machine& m) {
  if (m.absent().any()) {
    m.light(hal::Light::kRed);
    m.show("not ready, the {} is missing or wrong{}: see `firstlook check`", first_absent(m),
           m.absent().count() > 1 ? ", and more" : "");
    return;
  }
  m.light(hal::Light::kGreen);
  const bool stored = m.settings().scope == RunScope::kMap || m.settings().scope == RunScope::kVerify;
  m.show("ready: {}", stored ? "Play tests the stored calibration" : "press Play on the pendant");
}

/// A job that lacks a device does not begin, and not by itself when the device comes: Play must be pressed again.
bool lacks_device(Machine& m) {
  if (m.absent().none()) return false;
  m.progress().played = false;
  m.show("cannot start, the {} is missing or wrong: see `firstlook check`", first_absent(m));
  return true;
}

}  // namespace

void enter_ready(Machine& m) {
  if (m.finished()) {
    m.light(hal::Light::kGreen);
    return;
  }
  tell_ready(m);
}

/// What came while it waited is of no use to the job: so a journal need not tell it (worth_of).
void exit_ready(Machine& m) { m.forget_the_past(); }

Handled on_ready(Machine& m, const MachineEvent& event) {
  Progress& p = m.progress();
  if (const auto* key = std::get_if<OperatorActed>(&event)) {
    const bool play = key->action == hal::OperatorAction::kPlay;
    if (key->device == OperatorDevice::kPendant) {
      p.played = play && !lacks_device(m);
      p.played_at = m.now();
      if (p.played && m.settings().start_source == StartSource::kPanel) m.show("press the start button");
    } else if (play && m.settings().start_source == StartSource::kPanel && p.played && m.arm().program_running &&
               m.now() - p.played_at <= seconds(kPressWithin_s) && !lacks_device(m)) {
      m.transition(StateId::kLocateBoard);
    }
    return Handled::kYes;
  }
  if (std::holds_alternative<DeviceChanged>(event)) {
    tell_ready(m);
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
      m.arm().program_running && !lacks_device(m)) {
    m.transition(StateId::kLocateBoard);
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
