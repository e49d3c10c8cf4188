/// VerifyBoard and Park: the board must stand where it stood (safety rule 12), and the arm goes to its parking pose.
#include "app/machine/states/states.hpp"

namespace firstlook::states {

void enter_verify_board(Machine& m) {
  m.show("looking at the board again");
  plan_to(m, m.progress().board_view_rad, MotionPhase::kMapping);
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
    if (check->seen && !check->moved) {
      m.conclude(Outcome::kDone, std::nullopt);
    } else {
      m.conclude(Outcome::kSafelyStopped, check->seen ? Fault::kBoardMoved : Fault::kBoardNotFound);
    }
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
