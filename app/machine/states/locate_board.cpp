/// LocateBoard: turn until the board is seen, or until all are, inside the safe zone.
#include <bit>

#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {

void leave(Machine& m) {
  m.progress().views = {};
  m.transition(has_stored(m) ? StateId::kVerifyCalibration : StateId::kIdentifyLink);
}

/// A camera that the tilts of the first search did not move may be on an inner link: the second one moves it.
void search_in_vain(Machine& m) {
  Progress& p = m.progress();
  if (++p.searches > 1 || has_stored(m)) {
    m.conclude(Outcome::kSafelyStopped, Fault::kBoardNotLocated);
    return;
  }
  const JointVector start = p.views.views_rad.front();
  p.views = {};
  m.start_job(JobKind::kLocateViews, FromHere{start, p.searches, m.now().seconds()});
}

void go_to_view(Machine& m) {
  Progress& p = m.progress();
  if (p.view >= p.views.views_rad.size()) {
    if (p.located != 0) {
      m.show("{} of {} boards were seen", std::popcount(p.located), m.settings().targets);
      leave(m);
      return;
    }
    search_in_vain(m);
    return;
  }
  m.show("looking for the {}, view {} of {}", m.settings().targets > 1 ? "boards" : "board", p.view + 1,
         p.views.views_rad.size());
  plan_to(m, p.views.views_rad[p.view], phase_of(m));
}

void next_view(Machine& m) {
  ++m.progress().view;
  go_to_view(m);
}

}  // namespace

void enter_locate_board(Machine& m) {
  if (m.progress().views.views_rad.empty()) {
    m.start_job(JobKind::kLocateViews, FromHere{m.arm().position_rad, m.progress().searches, m.now().seconds()});
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
      m.conclude(Outcome::kSafelyStopped, p.searches > 0 ? Fault::kBoardNotLocated : list->fault);
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
    if (seen->found && p.located == 0) p.board_view_rad = m.arm().position_rad;
    if (seen->found) note_targets(m, seen->targets);
    // A stored calibration is tested on whichever board is seen first.
    if (std::popcount(p.located) >= (has_stored(m) ? 1 : m.settings().targets)) {
      leave(m);
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
