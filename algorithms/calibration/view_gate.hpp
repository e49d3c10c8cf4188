/// Finds the views that contradict the others: a stale pose, a board seen wrongly.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/calibration/mistakes/mistake_trial.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Flange pose that a view's board pose predicts, against what the arm said: pose_difference for each view.
/// @param base_T_board  by target
[[nodiscard]] std::vector<Vector6d> flange_misfits(std::span<const PosePair> pairs,
                                                   const Transform<Flange, Camera>& flange_T_camera,
                                                   std::span<const Transform<Base, Board>> base_T_board);

/// Median over the views of the lengths of flange_misfits against median_board_poses. A target's only view always fits
/// and does not count, unless there is no other.
[[nodiscard]] Misfit median_misfit(std::span<const PosePair> pairs, const Transform<Flange, Camera>& flange_T_camera);

/// The pose of a board that most views, all of this one, agree on: component-wise median of position, chordal mean of
/// the rotations near it.
[[nodiscard]] Transform<Base, Board> median_board_pose(std::span<const PosePair> pairs,
                                                       const Transform<Flange, Camera>& flange_T_camera);

/// The same for each target, by its number; identity for one that no view shows.
[[nodiscard]] std::vector<Transform<Base, Board>> median_board_poses(std::span<const PosePair> pairs,
                                                                     const Transform<Flange, Camera>& flange_T_camera);

/// False for each view whose misfit is more than `gate` times the median misfit of all, and that of its target when
/// three views or more show it (and more than 0.5 mm and 1 mrad).
[[nodiscard]] std::vector<bool> gate_views(std::span<const PosePair> pairs,
                                           const Transform<Flange, Camera>& flange_T_camera, double gate);

/// Solution that bears up to a third of wrong views: when one view stands out, the solve whose median misfit is
/// least among random fours of views (Rousseeuw 1984) tells the good ones, which are then solved together.
/// @return the errors of solve_pose_pairs
[[nodiscard]] Result<HandEyeSolution> solve_pose_pairs_robust(std::span<const PosePair> pairs, Solver solver,
                                                              double gate);

/// flange_T_camera of solve_pose_pairs_robust.
[[nodiscard]] Result<Transform<Flange, Camera>> robust_closed_form(std::span<const PosePair> pairs, Solver solver,
                                                                   double gate);

}  // namespace firstlook
