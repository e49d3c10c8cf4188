/// Sweep: the first look around, base joint and wrist, each step certified on what has been seen.
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {
constexpr std::uint32_t kReplansMax = 5;  // in a row: looks in between may free the arm's surroundings

/// Views have the numbers of views.csv. One without a way there is a look around from where the arm stands.
void look_around(Machine& m) {
  m.show("sweep view {}: looking around", m.progress().sweep_views + 1);
  m.start_look(true, 1);
}

void next_view(Machine& m) {
  m.start_job(JobKind::kNextSweepView, FromHere{m.arm().position_rad, m.progress().steps++, m.now().seconds()});
}

void take(Machine& m, const NextViewResult& choice) {
  Progress& p = m.progress();
  if (choice.found) {
    m.show("sweep view {}", p.sweep_views + 1);
    m.start_trip(choice.path, Machine::OnTheWay::kMap);
  } else if (choice.blocked && ++p.replans <= kReplansMax) {
    look_around(m);
  } else if (choice.blocked) {
    m.conclude(Outcome::kSafelyStopped, Fault::kStartBlocked);
  } else {
    m.transition(StateId::kChoose);
  }
}

}  // namespace

/// Before the first look the arm goes back to where it started, still by the rules of the safe zone: where the last
/// view of the board left it, the camera that is now known may be too near to the arm itself.
void enter_sweep(Machine& m) {
  if (m.progress().sweep_views == 0) {
    m.show("sweep view 1: from where the job began");
    plan_to(m, m.settings().parking_rad, MotionPhase::kBeforeCalibration);
  } else {
    look_around(m);
  }
}

Handled on_sweep(Machine& m, const MachineEvent& event) {
  Progress& p = m.progress();
  switch (m.advance_trip(event)) {
    case Machine::Trip::kArrived:
      p.replans = 0;
      m.start_look(true, 1);
      return Handled::kNo;
    case Machine::Trip::kInterrupted:
      m.start_look(true, 1);
      return Handled::kNo;
    default:
      break;
  }
  if (const auto plan = m.result_of<PlanResult>(JobKind::kPlan, event)) {
    if (plan->found) {
      m.start_trip(plan->path, Machine::OnTheWay::kNothing);
    } else {
      m.start_look(true, 1);
    }
  } else if (m.advance_look(event)) {
    m.integrate(m.look()[0], true);
  } else if (const auto result = m.integrate_result(event); result && result->at_view) {
    ++p.sweep_views;
    p.unknown = result->unknown;
    next_view(m);
  } else if (const auto choice = m.result_of<NextViewResult>(JobKind::kNextSweepView, event)) {
    take(m, *choice);
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
