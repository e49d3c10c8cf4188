/// Running: what holds in every phase of the job. Consent and the controller's safety state are watched here.
#include "app/machine/states/states.hpp"

namespace firstlook::states {

void enter_running(Machine& m) {
  m.light(hal::Light::kAmber);
  if (!may_move(m.arm().safety)) m.stop_for(Fault::kProtectiveStop);
}

namespace {
void pause(Machine& m) {
  m.progress().resume = m.state();
  m.transition(StateId::kPaused);
}
}  // namespace

Handled on_running(Machine& m, const MachineEvent& event) {
  if (const auto* report = std::get_if<ArmReported>(&event)) {
    if (!may_move(report->state.safety)) {
      m.stop_for(Fault::kProtectiveStop);
    } else if (!report->state.program_running) {
      pause(m);
    }
    return Handled::kYes;
  }
  if (heed_stop(m, event)) return Handled::kYes;
  if (const auto* key = std::get_if<OperatorActed>(&event)) {
    if (key->action == hal::OperatorAction::kPause) pause(m);
    return Handled::kYes;
  }
  if (const auto* asked = std::get_if<ShutdownAsked>(&event)) {
    m.stop_for(asked->cause);
    return Handled::kYes;
  }
  // A refusal that comes after its trip was withdrawn.
  return std::holds_alternative<CommandRefused>(event) ? Handled::kYes : Handled::kNo;
}

bool heed_stop(Machine& m, const MachineEvent& event) {
  const auto* key = std::get_if<OperatorActed>(&event);
  const auto* changed = std::get_if<DeviceChanged>(&event);
  const bool stop = key != nullptr && key->action == hal::OperatorAction::kStop;
  // The second tells of a panel that went just before the job began.
  const bool lost = (key != nullptr && key->action == hal::OperatorAction::kLost) ||
                    (changed != nullptr && changed->device == CartDevice::kPanel && !changed->present);
  if (stop) m.stop_for(Fault::kProgramStopped);
  if (lost) m.stop_for(Fault::kPanelLost);
  return stop || lost;
}

bool may_move(hal::ArmSafety safety) { return safety == hal::ArmSafety::kNormal || safety == hal::ArmSafety::kReduced; }

MotionPhase phase_of(Machine& m) {
  if (m.progress().calibration_accepted) return MotionPhase::kMapping;
  return m.progress().camera_on_flange || has_stored(m) ? MotionPhase::kBeforeCalibration : MotionPhase::kLinkUnknown;
}

bool has_stored(const Machine& m) {
  return m.settings().scope == RunScope::kMap || m.settings().scope == RunScope::kVerify;
}

void plan_to(Machine& m, const JointVector& target, MotionPhase phase) {
  PlanArguments plan;
  plan.from_rad = m.arm().position_rad;
  plan.to_rad = target;
  plan.phase = phase;
  plan.step = m.progress().steps++;
  plan.now_s = m.now().seconds();
  m.start_job(JobKind::kPlan, plan);
}

void certify_from_here(Machine& m, const Route& path, MotionPhase phase, bool foreseen) {
  PlanArguments plan;
  plan.from_rad = m.arm().position_rad;
  plan.phase = phase;
  plan.now_s = m.now().seconds();
  plan.path = path;
  if (!plan.path.empty()) plan.to_rad = plan.path.back().target_rad;
  plan.foreseen = foreseen;
  m.start_job(JobKind::kCertifyPath, plan);
}

}  // namespace firstlook::states
