/// Solve: the joint least squares over all views.
#include "app/machine/states/states.hpp"

namespace firstlook::states {

void enter_solve(Machine& m) {
  m.show("solving the calibration from {} views", m.progress().observations);
  m.start_job(JobKind::kSolve, NoArguments{});
}

Handled on_solve(Machine& m, const MachineEvent& event) {
  if (const auto result = m.result_of<SolveResult>(JobKind::kSolve, event)) {
    if (result->solved) {
      m.show("hand-eye sigma {:.2f} mm, {:.2f} mrad; reprojection {:.2f} px", result->sigma_mm, result->sigma_mrad,
             result->reprojection_rms_px);
      if (result->depth_estimated) {
        m.show("depth camera found {:.2f} mm, {:.2f} mrad from where it was said to be", result->depth_moved_mm,
               result->depth_moved_mrad);
      }
      if (result->offsets.color_s != 0 || result->offsets.depth_s != 0) {
        m.show("stamps corrected by {:.2f} ms (colour), {:.2f} ms (depth)", 1000 * result->offsets.color_s,
               1000 * result->offsets.depth_s);
      }
      m.progress().relevant = result->targets;
      m.progress().stamps_wrong = result->stamps_wrong;
      m.progress().stamp_offsets = result->offsets;
      m.transition(StateId::kValidate);
    } else {
      m.conclude(Outcome::kCalibrationRejected, result->fault);
    }
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
