/// Validate: views held out of the solve decide whether the calibration is used.
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {

/// Nobody needs to touch a board that the calibration does not rest on. The first board is the one to touch.
bool shows_touched_board(Machine& m) { return (m.progress().relevant & 1U) != 0; }

}  // namespace

void enter_validate(Machine& m) {
  m.show("validating the calibration");
  m.start_job(JobKind::kValidate, NoArguments{});
}

Handled on_validate(Machine& m, const MachineEvent& event) {
  if (const auto result = m.result_of<ValidateResult>(JobKind::kValidate, event)) {
    Progress& p = m.progress();
    if (result->more_views_tell && p.views_asked_for == 0) {
      m.show("the last view contradicts the others: looking {} more times", kSecondLooks);
      p.views_asked_for = p.observations + kSecondLooks;
      m.transition(StateId::kCollect);
      return Handled::kNo;
    }
    // Not before: more views are seen as those before them were.
    if (!p.stamps_wrong) m.correct_stamps(p.stamp_offsets);
    if (!result->accepted) {
      m.conclude(Outcome::kCalibrationRejected, Fault::kCalibrationRejected);
    } else if (p.stamps_wrong) {
      // Where a frame is taken to be from decides what counts as seen to be free. Asked after the verdict: a board that
      // was moved fits no stamps, either.
      m.stop_for(Fault::kClockWrong);
    } else if (!m.settings().touch_points.empty()) {
      if (shows_touched_board(m)) {
        m.transition(StateId::kTouchTest);
      } else {
        m.conclude(Outcome::kCalibrationRejected, Fault::kTouchesUnusable);
      }
    } else if (m.settings().scope == RunScope::kCalibrate) {
      m.conclude(Outcome::kDone, std::nullopt);
    } else {
      p.calibration_accepted = true;
      m.show("calibration accepted; clearance {:.0f} mm", 1000 * result->clearance_m);
      m.transition(StateId::kSweep);
    }
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
