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
    if (!result->accepted) {
      m.conclude(Outcome::kCalibrationRejected, Fault::kCalibrationRejected);
    } else if (m.progress().stamps_wrong) {
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
      m.progress().calibration_accepted = true;
      m.show("calibration accepted; clearance {:.0f} mm", 1000 * result->clearance_m);
      m.transition(StateId::kSweep);
    }
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
