/// Sweep: the first look around, base joint and wrist, each step certified on what has been seen.
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {
constexpr std::uint32_t kReplansMax = 5;  // in a row: looks in between may free the arm's surroundings

void next_view(Machine& m) {
  m.start_job(JobKind::kNextSweepView, FromHere{m.arm().position_rad, m.progress().steps++, m.now().seconds()});
}

void take(Machine& m, const NextViewResult& choice) {
  Progress& p = m.progress();
  if (choice.found) {
    m.show("sweep view {}", p.sweep_views + 1);
    m.start_trip(choice.path, true);
  } else if (choice.blocked && ++p.replans <= kReplansMax) {
    m.start_look(true, 1);
  } else if (choice.blocked) {
    m.conclude(Outcome::kSafelyStopped, Fault::kStartBlocked);
  } else {
    m.transition(StateId::kChoose);
  }
}

}  // namespace

void enter_sweep(Machine& m) { m.start_look(true, 1); }

Handled on_sweep(Machine& m, const MachineEvent& event) {
  Progress& p = m.progress();
  switch (m.advance_trip(event)) {
    case Machine::Trip::kArrived:
      p.replans = 0;
      m.start_look(true, 1);
      return Handled::kNo;
    case Machine::Trip::kInterrupted: m.start_look(true, 1); return Handled::kNo;
    default: break;
  }
  if (m.advance_look(event)) {
    m.integrate(m.look()[0], true);
  } else if (const auto result = m.integrate_result(event); result && result->at_view) {
    ++p.sweep_views;
    next_view(m);
  } else if (const auto choice = m.result_of<NextViewResult>(JobKind::kNextSweepView, event)) {
    take(m, *choice);
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
