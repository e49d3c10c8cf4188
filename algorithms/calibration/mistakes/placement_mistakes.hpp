/// Views that agree in groups but not together: a board or an arm's base that was moved, two boards, corners in another
/// order.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/calibration/mistakes/mistake_trial.hpp"
#include "algorithms/vision/target.hpp"

namespace firstlook::mistakes {

/// The set with every group's board moved to where the largest group sees it. Empty unless two to four groups of three
/// views or more hold nine tenths of the views. `board` tells a corner order from a board that moved; may be null.
[[nodiscard]] std::optional<Trial> placement_trial(std::span<const PosePair> pairs, const BoardSpec* board);

/// What became of views that contradict the others under a solution that the others share: poses exchanged, an old
/// pose, a board seen in another corner order or of another size. One sentence; empty when nothing explains any of
/// them.
[[nodiscard]] std::string explain_left_out(std::span<const PosePair> pairs, const std::vector<bool>& kept,
                                           const Transform<Flange, Camera>& flange_T_camera, const BoardSpec* board);

/// All or most views are one and the same, or one side stands still while the other moves. Empty when it is not so.
[[nodiscard]] std::string explain_views_alike(std::span<const PosePair> pairs);

}  // namespace firstlook::mistakes
