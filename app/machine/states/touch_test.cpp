/// TouchTest: a person leads the arm's tip onto corners of the board and confirms each; firstlook moves nothing. What
/// follows moves by itself again, so the arm must be back in the space that the rules of safety vouch for, and a person
/// must have said so.
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {

constexpr double kStill_s = 0.4;         // 50 reports at 125 Hz: their mean has a seventh of an encoder's noise
constexpr double kSamePlace_rad = 1e-3;  // a confirmation pressed twice

bool all_touched(Machine& m) { return m.progress().touches.size() >= m.settings().touch_points.size(); }

/// What the person is to do next. The simulated person reads these lines, too (hal/sim/touching_hand.cpp).
void ask(Machine& m) {
  const auto& points = m.settings().touch_points;
  const std::size_t done = m.progress().touches.size();
  m.set_timer(MachineTimer::kState, m.settings().touch_time_max_s);
  if (all_touched(m)) {
    m.show("bring the arm back to where it stood, stand clear and confirm: it moves by itself then");
    return;
  }
  const std::int32_t point = points[done], columns = m.settings().touch_columns;
  if (columns > 0) {
    m.show("touch {} of {}: lead the tip onto column {}, row {}, then confirm", done + 1, points.size(),
           point % columns, point / columns);
  } else {
    m.show("touch {} of {}: lead the tip onto point {}, then confirm", done + 1, points.size(), point);
  }
}

void confirm(Machine& m) {
  Progress& p = m.progress();
  const auto stood = m.stood_at(kStill_s);
  if (!stood) {
    m.show("the arm must stand still: hold it, then confirm again");
  } else if (all_touched(m)) {
    m.forget_known_free();  // somebody was in it (safety rule 7)
    plan_to(m, m.settings().parking_rad, MotionPhase::kBeforeCalibration);
  } else if (!p.touches.empty() && (*stood - p.touches.back().at_rad).max_abs() < kSamePlace_rad) {
    m.show("the arm still stands where it touched the last corner: lead it on, then confirm");
  } else {
    p.touches.push_back({m.settings().touch_points[p.touches.size()], *stood});
    ask(m);
  }
}

void conclude(Machine& m, const TouchTestResult& result) {
  if (!result.usable) {
    m.conclude(Outcome::kCalibrationRejected, result.fault);
    return;
  }
  m.show("touches fit to {:.2f} mm; camera off by {:.2f} mm, {:.2f} mrad; chi-square {:.1f}, allowed {:.1f}",
         result.residual_rms_mm, result.error_mm, result.error_mrad, result.chi2, result.chi2_limit);
  if (!result.agrees) {
    m.conclude(Outcome::kCalibrationRejected, Fault::kCalibrationRejected);
  } else if (m.settings().scope == RunScope::kCalibrate) {
    m.conclude(Outcome::kDone, std::nullopt);
  } else {
    m.progress().calibration_accepted = true;
    m.show("calibration accepted; clearance {:.0f} mm", 1000 * result.clearance_m);
    m.transition(StateId::kSweep);
  }
}

}  // namespace

/// After a pause, too: the corners touched so far count. A person may well pause the program to lead the arm by hand.
void enter_touch_test(Machine& m) { ask(m); }

void exit_touch_test(Machine& m) { m.cancel_timer(MachineTimer::kState); }

Handled on_touch_test(Machine& m, const MachineEvent& event) {
  if (const auto* key = std::get_if<OperatorActed>(&event); key && key->action == hal::OperatorAction::kConfirm) {
    confirm(m);
    return Handled::kYes;
  }
  if (const auto* timer = std::get_if<TimerFired>(&event); timer && timer->timer == MachineTimer::kState) {
    m.stop_for(Fault::kTouchTestEnded);
    return Handled::kYes;
  }
  if (const auto plan = m.result_of<PlanResult>(JobKind::kPlan, event)) {
    if (plan->found) {
      m.start_job(JobKind::kTouchTest, TouchTestArguments{m.progress().touches});
    } else {
      m.show("no certified way from here: bring the arm into the safe zone, then confirm");
    }
  } else if (const auto result = m.result_of<TouchTestResult>(JobKind::kTouchTest, event)) {
    conclude(m, *result);
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
