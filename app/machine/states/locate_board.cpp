/// LocateBoard: turn until the board is seen, inside the safe zone.
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {

void go_to_view(Machine& m) {
  Progress& p = m.progress();
  if (p.view >= p.views.views_rad.size()) {
    m.conclude(Outcome::kSafelyStopped, Fault::kBoardNotLocated);
    return;
  }
  m.show("looking for the board, view {} of {}", p.view + 1, p.views.views_rad.size());
  plan_to(m, p.views.views_rad[p.view], MotionPhase::kBeforeCalibration);
}

void next_view(Machine& m) {
  ++m.progress().view;
  go_to_view(m);
}

}  // namespace

void enter_locate_board(Machine& m) {
  if (m.progress().views.views_rad.empty()) {
    m.start_job(JobKind::kLocateViews, FromHere{m.arm().position_rad, 0, m.now().seconds()});
  } else {
    go_to_view(m);
  }
}

Handled on_locate_board(Machine& m, const MachineEvent& event) {
  Progress& p = m.progress();
  if (const auto list = m.result_of<ViewList>(JobKind::kLocateViews, event)) {
    p.views = *list;
    p.view = 0;
    if (p.views.views_rad.empty()) {
      m.conclude(Outcome::kSafelyStopped, list->fault);
    } else {
      go_to_view(m);
    }
  } else if (const auto plan = m.result_of<PlanResult>(JobKind::kPlan, event)) {
    if (plan->found) {
      m.start_trip(plan->path, Machine::OnTheWay::kNothing);
    } else {
      next_view(m);
    }
  } else if (m.advance_look(event)) {
    m.start_job(JobKind::kDetectBoard, DetectArguments{BoardLook::kLocate, 0, m.look()});
  } else if (const auto seen = m.result_of<DetectResult>(JobKind::kDetectBoard, event)) {
    if (seen->found) {
      p.board_view_rad = m.arm().position_rad;
      p.views = {};
      const bool stored = m.settings().scope == RunScope::kMap || m.settings().scope == RunScope::kVerify;
      m.transition(stored ? StateId::kVerifyCalibration : StateId::kIdentifyLink);
    } else {
      next_view(m);
    }
  }
  switch (m.advance_trip(event)) {
    case Machine::Trip::kArrived:
      m.start_look(false, 1);
      break;
    case Machine::Trip::kInterrupted:
      go_to_view(m);
      break;
    default:
      break;
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
