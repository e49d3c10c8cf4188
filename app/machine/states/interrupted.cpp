/// Paused, Stopped, Faulted: the segment is withdrawn; after a pause the state it came from asks for a new one.
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {
constexpr double kLongPause_s = 60;   // then what was known free must be seen again (safety rule 7)
constexpr double kPauseMax_s = 3600;  // then the job ends

/// Within Explore every pause leads back to choosing: the way is planned from where the arm is then.
StateId resume_state(StateId paused) { return is_within(paused, StateId::kExplore) ? StateId::kChoose : paused; }
}  // namespace

void enter_paused(Machine& m) {
  Progress& p = m.progress();
  p.paused_at = m.now();
  m.light(hal::Light::kAmber);
  m.show("paused: press Play to go on");
  m.set_timer(MachineTimer::kState, kPauseMax_s);
}

/// What came in the pause is of no use to what follows, as in Ready: so a journal need not tell it (worth_of).
void exit_paused(Machine& m) { m.forget_the_past(); }

Handled on_paused(Machine& m, const MachineEvent& event) {
  Progress& p = m.progress();
  if (const auto* report = std::get_if<ArmReported>(&event)) {
    if (!may_move(report->state.safety)) {
      m.stop_for(Fault::kProtectiveStop);
    } else if (report->state.program_running && !report->state.moving) {
      m.cancel_timer(MachineTimer::kState);
      if (m.now() - p.paused_at > seconds(kLongPause_s)) m.forget_known_free();
      m.transition(resume_state(p.resume));
    }
    return Handled::kYes;
  }
  if (heed_stop(m, event) || std::holds_alternative<OperatorActed>(event)) return Handled::kYes;
  if (const auto* timer = std::get_if<TimerFired>(&event); timer && timer->timer == MachineTimer::kState) {
    m.stop_for(Fault::kPausedTooLong);
    return Handled::kYes;
  }
  if (const auto* asked = std::get_if<ShutdownAsked>(&event)) {
    m.stop_for(asked->cause);
    return Handled::kYes;
  }
  return std::holds_alternative<CommandRefused>(event) ? Handled::kYes : Handled::kNo;
}

void enter_stopped(Machine& m) {
  m.light(hal::Light::kRed);
  m.forget_known_free();
  m.show("stopped: {}", fault_row(m.progress().ending.fault).text);
  m.finish(m.progress().ending);
}

void enter_faulted(Machine& m) {
  m.light(hal::Light::kRed);
  m.show("fault: {}", fault_row(m.progress().ending.fault).text);
  m.finish(m.progress().ending);
}

Handled on_ended(Machine&, const MachineEvent& event) {
  return std::holds_alternative<OperatorActed>(event) ? Handled::kYes : Handled::kNo;
}

}  // namespace firstlook::states
