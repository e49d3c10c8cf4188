/// Collect: the views of the board from which the hand-eye transform is solved, each chosen for what it adds.
#include <algorithm>

#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {
constexpr std::uint32_t kFailedLooksMax = 24;  // in a row: the first turns are made blindly and may lose the board
constexpr std::uint32_t kForeseenFrom = 6;  // observations, from which on a view hardly changes what the next should be

void next_view(Machine& m) {
  Progress& p = m.progress();
  const auto most = static_cast<std::uint32_t>(m.settings().calibration_views_max);
  if (p.observations >= std::max(most, p.views_asked_for)) {
    m.transition(StateId::kSolve);
    return;
  }
  m.start_job(JobKind::kNextCalibrationView, FromHere{m.arm().position_rad, p.steps++, m.now().seconds()});
}

void go(Machine& m) {
  Progress& p = m.progress();
  if (p.aiming.sigma_mm > 0) {
    m.show("calibration view {}: predicted sigma {:.2f} mm, {:.2f} mrad", p.observations + 1, p.aiming.sigma_mm,
           p.aiming.sigma_mrad);
  } else {
    m.show("calibration view {}: a small turn, to learn where the camera sits", p.observations + 1);
  }
  m.start_trip(p.aiming.path, Machine::OnTheWay::kSeeBoard);
  const auto most = static_cast<std::uint32_t>(m.settings().calibration_views_max);
  if (p.observations >= kForeseenFrom && p.observations + 1 < most && m.settings().targets == 1)
    m.foresee(JobKind::kNextCalibrationView);
}

void take(Machine& m, const CalibrationViewResult& choice, bool foreseen) {
  Progress& p = m.progress();
  const bool enough = p.observations >= static_cast<std::uint32_t>(m.settings().calibration_views_min);
  if (choice.target_met && enough && p.observations >= p.views_asked_for) {
    m.transition(StateId::kSolve);
  } else if (choice.found) {
    p.aiming = choice;
    if (foreseen) {
      // The arm stands a little beside the place that it was chosen for.
      certify_from_here(m, p.aiming.path, MotionPhase::kBeforeCalibration, false);
    } else {
      go(m);
    }
  } else if (enough) {
    m.transition(StateId::kSolve);
  } else {
    m.conclude(Outcome::kCalibrationRejected, Fault::kTooFewViews);
  }
}

}  // namespace

void note_targets(Machine& m, TargetMask seen) {
  Progress& p = m.progress();
  const auto first = static_cast<TargetMask>(seen & ~p.located);
  if (first == 0 || p.target_views.full()) return;
  p.target_views.push_back({m.arm().position_rad, first});
  p.located |= first;
  p.relevant = p.located;
}

void enter_collect(Machine& m) { next_view(m); }

Handled on_collect(Machine& m, const MachineEvent& event) {
  Progress& p = m.progress();
  if (const auto choice = m.result_of<CalibrationViewResult>(JobKind::kNextCalibrationView, event)) {
    take(m, *choice, false);
  } else if (const auto plan = m.result_of<PlanResult>(JobKind::kCertifyPath, event)) {
    if (plan->found) {
      go(m);
    } else {
      next_view(m);
    }
  } else if (m.advance_look(event)) {
    m.start_job(JobKind::kDetectBoard,
                DetectArguments{BoardLook::kCollect, p.observations, m.look(), m.looks(), m.depth_beside()});
  } else if (const auto seen = m.result_of<DetectResult>(JobKind::kDetectBoard, event)) {
    if (!seen->still && m.look_again(seen->moved_px)) return Handled::kNo;
    if (seen->found) {
      note_targets(m, seen->targets);
      ++p.observations;
      p.failed_looks = 0;
      if (const auto next = m.foreseen_calibration_view(); next && next->found) {
        take(m, *next, true);
        return Handled::kNo;
      }
    } else if (++p.failed_looks > kFailedLooksMax) {
      m.conclude(Outcome::kCalibrationRejected, Fault::kBoardNotFound);
      return Handled::kNo;
    }
    next_view(m);
  }
  switch (m.advance_trip(event)) {
    case Machine::Trip::kArrived:
      m.start_look(false, m.settings().frames_per_view);
      break;
    case Machine::Trip::kInterrupted:
      next_view(m);
      break;
    default:
      break;
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
