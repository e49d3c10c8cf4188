/// Validate: views held out of the solve decide whether the calibration is used.
#include "app/machine/states/states.hpp"

namespace firstlook::states {

void enter_validate(Machine& m) {
  m.show("validating the calibration");
  m.start_job(JobKind::kValidate, NoArguments{});
}

Handled on_validate(Machine& m, const MachineEvent& event) {
  if (const auto result = m.result_of<ValidateResult>(JobKind::kValidate, event)) {
    if (!result->accepted) {
      m.conclude(Outcome::kCalibrationRejected, Fault::kCalibrationRejected);
    } else if (!m.settings().touch_points.empty()) {
      m.transition(StateId::kTouchTest);
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
