/// Handlers of the states, one file for each. state_table.cpp says which belongs where.
#pragma once

#include "app/machine/machine.hpp"

namespace firstlook::states {

void enter_boot(Machine& m);
Handled on_boot(Machine& m, const MachineEvent& event);
void enter_ready(Machine& m);
void exit_ready(Machine& m);
Handled on_ready(Machine& m, const MachineEvent& event);
void enter_running(Machine& m);
Handled on_running(Machine& m, const MachineEvent& event);
void enter_locate_board(Machine& m);
Handled on_locate_board(Machine& m, const MachineEvent& event);
void enter_identify_link(Machine& m);
Handled on_identify_link(Machine& m, const MachineEvent& event);
void enter_collect(Machine& m);
Handled on_collect(Machine& m, const MachineEvent& event);
void enter_solve(Machine& m);
Handled on_solve(Machine& m, const MachineEvent& event);
void enter_validate(Machine& m);
Handled on_validate(Machine& m, const MachineEvent& event);
void enter_touch_test(Machine& m);
void exit_touch_test(Machine& m);
Handled on_touch_test(Machine& m, const MachineEvent& event);
void enter_verify_calibration(Machine& m);
Handled on_verify_calibration(Machine& m, const MachineEvent& event);
void enter_sweep(Machine& m);
Handled on_sweep(Machine& m, const MachineEvent& event);
void enter_choose(Machine& m);
Handled on_choose(Machine& m, const MachineEvent& event);
void enter_plan(Machine& m);
Handled on_plan(Machine& m, const MachineEvent& event);
void enter_move(Machine& m);
Handled on_move(Machine& m, const MachineEvent& event);
void enter_look(Machine& m);
Handled on_look(Machine& m, const MachineEvent& event);
void enter_verify_board(Machine& m);
Handled on_verify_board(Machine& m, const MachineEvent& event);
void enter_park(Machine& m);
Handled on_park(Machine& m, const MachineEvent& event);
void enter_report(Machine& m);
Handled on_report(Machine& m, const MachineEvent& event);
void enter_paused(Machine& m);
void exit_paused(Machine& m);
Handled on_paused(Machine& m, const MachineEvent& event);
void enter_stopped(Machine& m);
void enter_faulted(Machine& m);
Handled on_ended(Machine& m, const MachineEvent& event);

/// False from a protective or emergency stop until a person has cleared it.
[[nodiscard]] bool may_move(hal::ArmSafety safety);
/// Stops the job when a person asks for it, or when the panel is gone and nobody could hear them ask. True when it did.
[[nodiscard]] bool heed_stop(Machine& m, const MachineEvent& event);
/// Remembers from where targets were seen for the first time.
void note_targets(Machine& m, TargetMask seen);
/// Asks for a path from here to `target`.
void plan_to(Machine& m, const JointVector& target, MotionPhase phase);
/// Asks whether a path that was chosen before holds from where the arm is now. `foreseen`: PlanArguments::foreseen.
void certify_from_here(Machine& m, const Route& path, MotionPhase phase, bool foreseen);
/// The body and space that motions are certified for now.
[[nodiscard]] MotionPhase phase_of(Machine& m);
/// The job is to use a calibration from elsewhere, which says that the camera is on the flange.
[[nodiscard]] bool has_stored(const Machine& m);

}  // namespace firstlook::states
