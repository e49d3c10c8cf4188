/// Boards whose pose one picture leaves open (the same upside down, or a plane that could lean either way): all poses
/// are kept, and the arm's motion over several views settles which of them were true.
#pragma once

#include <span>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/vision/board_pose.hpp"
#include "algorithms/vision/target.hpp"

namespace firstlook {

/// One of the poses that a picture allows.
struct PoseChoice {
  Transform<Camera, Board> camera_T_board;
  bool reversed = false;  ///< the points in reverse order
  bool other = false;     ///< BoardPose::other
};

/// A view with all that its picture allows, the likeliest first.
struct OpenView {
  Transform<Base, Flange> base_T_flange;
  std::vector<PoseChoice> choices;
  int target = 0;  ///< as in CalibrationView
};

/// The board's frame turned by 180 degrees about the board's middle: what reversing the points does to a pose.
[[nodiscard]] Transform<Board, Board> half_turn(const BoardSpec& board);

/// The poses that a view leaves open whose points are in the right order: `pose`, and its other one unless its fit is
/// worse by more than 30 in logarithmic likelihood.
[[nodiscard]] OpenView seen_one_way(const CalibrationView& view, const BoardPose& pose);

/// The same with the points in either order, when the board looks the same upside down.
[[nodiscard]] OpenView open_view(const BoardSpec& board, const CalibrationView& view, const BoardPose& pose);

/// Index of the true choice of each view: under random fours of views in closed form, with each combination of their
/// choices, the one under which all views agree best on the board's place. The first view is not reversed. All 0 with
/// fewer than four views or when nothing can be told. Several targets are settled one by one; one with fewer views than
/// that under the hand-eye transform that the others give. 3 to 7 ms for 4 to 30 views of two choices each.
[[nodiscard]] std::vector<std::size_t> settle_choices(std::span<const OpenView> views);

/// The same with a known hand-eye transform, from two views on.
[[nodiscard]] std::vector<std::size_t> settle_choices(std::span<const OpenView> views,
                                                      const Transform<Flange, Camera>& flange_T_camera);

/// Makes `pose` the choice that was settled on, its other one kept beside it.
void adopt_choice(const BoardSpec& board, const PoseChoice& choice, BoardPose& pose);

}  // namespace firstlook
