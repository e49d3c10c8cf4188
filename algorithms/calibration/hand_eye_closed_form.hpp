/// Hand-eye transform from pose pairs without a start value, by any of the solvers in solvers/.
#pragma once

#include <span>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/calibration/solvers/solver_table.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Solves pairs in any order: the same pairs give the same bits. Exact on noise-free data to rounding (1e-9 mm, 1e-9
/// rad for motions of 20 degrees and more, any hand-eye rotation). With 25 pairs 0.1 to 2 ms, growing with the square
/// of their number.
/// With several targets motions are those between views of the same one; the solvers of AX = YB then get all views as
/// if they showed the lowest numbered target, whose pose is their base_T_board.
/// @return kTooFewViews; kDegenerateMotion, which names what is missing: axes, angles, or what this solver cannot take
/// (solver_table); kSolveFailed for poses that are not finite or not rigid
[[nodiscard]] Result<HandEyeSolution> solve_pose_pairs(std::span<const PosePair> pairs, Solver solver);

/// flange_T_camera of solve_pose_pairs.
[[nodiscard]] Result<Transform<Flange, Camera>> solve_closed_form(std::span<const PosePair> pairs,
                                                                  Solver solver = Solver::kParkMartin);

/// Mean over the views, all of one target, of base_T_flange * flange_T_camera * camera_T_board (rotations: chordal
/// mean).
[[nodiscard]] Transform<Base, Board> mean_board_pose(std::span<const PosePair> pairs,
                                                     const Transform<Flange, Camera>& flange_T_camera);

/// How badly AX = XB is met, A and B the motions of flange and camera between two views. Rotation: angle of
/// (AX)^-1 (XB); translation: distance of AX's and XB's origins. RMS over the motions.
struct AxXbResidual {
  double rotation_rms_deg = 0;
  double translation_rms_mm = 0;
};
[[nodiscard]] AxXbResidual ax_xb_residual_all_pairs(std::span<const PosePair> pairs,
                                                    const Transform<Flange, Camera>& flange_T_camera);
[[nodiscard]] AxXbResidual ax_xb_residual_consecutive(std::span<const PosePair> pairs,
                                                      const Transform<Flange, Camera>& flange_T_camera);

/// The same contradiction seen at the board: RMS angle and distance of base_T_flange * flange_T_camera * camera_T_board
/// of each view from their mean (what ViSP prints as the residual of a hand-eye calibration).
[[nodiscard]] AxXbResidual board_in_base_residual(std::span<const PosePair> pairs,
                                                  const Transform<Flange, Camera>& flange_T_camera);

}  // namespace firstlook
