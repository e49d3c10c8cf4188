/// VerifyCalibration: a stored calibration is tested on views of the board before anything relies on it. Until it holds
/// the camera may be anywhere within its envelope.
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {
constexpr std::uint32_t kViewsMax = 8;  // when the least number leaves the test too weak

void test(Machine& m) {
  m.show("testing the stored calibration on {} views", m.progress().observations);
  m.start_job(JobKind::kVerifyCalibration, NoArguments{});
}

/// First a look from where the board was found, then from where the test gains most.
void next_view(Machine& m) {
  Progress& p = m.progress();
  if (p.observations == 0 && p.failed_looks == 0) {
    plan_to(m, p.board_view_rad, MotionPhase::kBeforeCalibration);
  } else {
    m.start_job(JobKind::kNextVerificationView, FromHere{m.arm().position_rad, p.steps++, m.now().seconds()});
  }
}

void take(Machine& m, const VerificationViewResult& choice) {
  const std::uint32_t views = m.progress().observations;
  const bool enough = views >= static_cast<std::uint32_t>(m.settings().verify_views);
  if ((enough && (choice.target_met || views >= kViewsMax)) || !choice.found) {
    test(m);
  } else {
    if (choice.detectable_mm > 0) {
      m.show("verification view {}: fewer would miss an error of {:.1f} mm or {:.1f} mrad", views + 1,
             choice.detectable_mm, choice.detectable_mrad);
    } else {
      m.show("verification view {}", views + 1);
    }
    m.start_trip(choice.path, Machine::OnTheWay::kNothing);
  }
}

void conclude(Machine& m, const VerifyResult& result) {
  if (result.chi2_limit > 0) {
    m.show("chi-square {:.1f}, allowed {:.1f}; {:.2f} px", result.chi2, result.chi2_limit, result.residual_rms_px);
  }
  if (!result.accepted) {
    m.conclude(Outcome::kCalibrationRejected, Fault::kCalibrationRejected);
  } else if (m.settings().scope == RunScope::kVerify) {
    m.conclude(Outcome::kDone, std::nullopt);
  } else {
    m.progress().calibration_accepted = true;
    m.progress().relevant = result.targets;
    m.correct_stamps(result.offsets);
    m.show("the stored calibration holds; clearance {:.0f} mm", 1000 * result.clearance_m);
    m.transition(StateId::kSweep);
  }
}

}  // namespace

void enter_verify_calibration(Machine& m) { next_view(m); }

Handled on_verify_calibration(Machine& m, const MachineEvent& event) {
  Progress& p = m.progress();
  if (const auto plan = m.result_of<PlanResult>(JobKind::kPlan, event)) {
    if (plan->found) {
      m.start_trip(plan->path, Machine::OnTheWay::kNothing);
    } else {
      ++p.failed_looks;
      next_view(m);
    }
  } else if (const auto choice = m.result_of<VerificationViewResult>(JobKind::kNextVerificationView, event)) {
    take(m, *choice);
  } else if (m.advance_look(event)) {
    m.start_job(JobKind::kDetectBoard, DetectArguments{BoardLook::kVerify, p.observations, m.look(), m.looks()});
  } else if (const auto seen = m.result_of<DetectResult>(JobKind::kDetectBoard, event)) {
    if (!seen->still && m.look_again(seen->moved_px)) return Handled::kNo;
    if (seen->found) note_targets(m, seen->targets);
    ++(seen->found ? p.observations : p.failed_looks);
    next_view(m);
  } else if (const auto result = m.result_of<VerifyResult>(JobKind::kVerifyCalibration, event)) {
    conclude(m, *result);
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
