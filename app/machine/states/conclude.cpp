/// VerifyBoard and Park: each board must stand where it stood (safety rule 12), and the arm goes to its parking pose.
#include "app/machine/states/states.hpp"

namespace firstlook::states {

namespace {

/// Targets that the place shows and that are still to be looked at.
TargetMask open_targets(const Progress& p, const TargetView& view) {
  return static_cast<TargetMask>(view.targets & p.relevant & ~p.standing);
}

void look_at_next(Machine& m) {
  Progress& p = m.progress();
  while (p.view < p.target_views.size() && open_targets(p, p.target_views[p.view]) == 0) ++p.view;
  if (p.view == p.target_views.size()) {
    m.conclude(Outcome::kDone, std::nullopt);
    return;
  }
  m.show("looking at the board again");
  plan_to(m, p.target_views[p.view].at_rad, MotionPhase::kMapping);
}

void judge(Machine& m, const CheckBoardResult& check) {
  Progress& p = m.progress();
  const TargetMask open = open_targets(p, p.target_views[p.view]);
  if (check.moved != 0) {
    m.conclude(Outcome::kSafelyStopped, Fault::kBoardMoved);
  } else if ((open & ~check.seen) != 0) {
    m.conclude(Outcome::kSafelyStopped, Fault::kBoardNotFound);
  } else {
    p.standing |= check.seen;
    look_at_next(m);
  }
}

}  // namespace

void enter_verify_board(Machine& m) {
  m.progress().view = 0;
  look_at_next(m);
}

Handled on_verify_board(Machine& m, const MachineEvent& event) {
  if (const auto plan = m.result_of<PlanResult>(JobKind::kPlan, event)) {
    if (plan->found) {
      m.start_trip(plan->path, Machine::OnTheWay::kMap);
    } else {
      m.conclude(Outcome::kSafelyStopped, plan->fault);
    }
  } else if (m.advance_look(event)) {
    m.start_job(JobKind::kCheckBoard, DetectArguments{BoardLook::kConclude, 0, m.look(), m.looks()});
  } else if (const auto check = m.result_of<CheckBoardResult>(JobKind::kCheckBoard, event)) {
    if (!check->still && m.look_again(check->moved_px)) return Handled::kNo;
    judge(m, *check);
  }
  switch (m.advance_trip(event)) {
    case Machine::Trip::kArrived:
      m.start_look(false, m.settings().frames_per_view);
      break;
    case Machine::Trip::kInterrupted:
      enter_verify_board(m);
      break;
    default:
      break;
  }
  return Handled::kNo;
}

void enter_park(Machine& m) {
  m.show("parking");
  plan_to(m, m.settings().parking_rad, phase_of(m));
}

Handled on_park(Machine& m, const MachineEvent& event) {
  if (const auto plan = m.result_of<PlanResult>(JobKind::kPlan, event)) {
    if (plan->found) {
      m.start_trip(plan->path,
                   phase_of(m) == MotionPhase::kMapping ? Machine::OnTheWay::kMap : Machine::OnTheWay::kNothing);
    } else {
      m.show("no certified way to the parking pose: the arm stays where it is");
      m.transition(StateId::kReport);
    }
  }
  switch (m.advance_trip(event)) {
    case Machine::Trip::kArrived:
      m.transition(StateId::kReport);
      break;
    case Machine::Trip::kInterrupted:
      enter_park(m);
      break;
    default:
      break;
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
