/// Hand-eye transform from pose pairs in closed form: no start value, no iterations.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "algorithms/calibration/calibration_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

enum class Solver : std::uint8_t {
  kParkMartin,  ///< Park and Martin 1994, "Robot sensor calibration: solving AX = XB on the Euclidean group"
  kTsaiLenz,    ///< Tsai and Lenz 1989, "A new technique for fully autonomous and efficient 3D robotics hand/eye
                ///< calibration"
};

/// "park-martin" or "tsai-lenz"; empty for any other name.
[[nodiscard]] std::optional<Solver> find_solver(std::string_view name);
[[nodiscard]] std::string_view solver_name(Solver solver);

/// How much the flange turned among the views: what the hand-eye transform can be told from.
struct MotionDiversity {
  int axes = 0;                ///< independent rotation axes found (0, 1 or 2): 2 are needed
  double angle_max_rad = 0;    ///< largest rotation between two views
  double second_axis_rad = 0;  ///< RMS rotation about the second of the two strongest axes: the weak direction
};
[[nodiscard]] MotionDiversity motion_diversity(std::span<const PosePair> pairs);

/// flange_T_camera from three or more pairs in any order, relative motions between all pairs of views; exact on
/// noise-free data. About 0.3 ms for 25 pairs, growing with the square of their number.
/// @return kTooFewViews, kDegenerateMotion (names the number of axes and the range of angles), kSolveFailed for
/// numbers that are not finite
[[nodiscard]] Result<Transform<Flange, Camera>> solve_closed_form(std::span<const PosePair> pairs,
                                                                  Solver solver = Solver::kParkMartin);

/// Mean over the views of base_T_flange * flange_T_camera * camera_T_board (rotations: chordal mean).
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
