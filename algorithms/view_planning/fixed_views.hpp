/// A fixed list of camera poses before the board, for comparison with views that are designed.
#pragma once

#include <array>

#include "algorithms/calibration/view_design.hpp"
#include "algorithms/view_planning/calibration_views.hpp"

namespace firstlook {

inline constexpr int kFixedViews = 48;

/// Where the camera stands in each of them, in the manner of the thesis (section 7: "the image of the marker moves over
/// the sensor and reaches the edges of the sensor"): the board keeps the distance at which it is seen in `first`, and
/// moves over twelve places of the picture, four columns by three rows, the outer ones at `margin_px` from the edge;
/// this in four orientations (as in `first`, tilted by 25 degrees about the picture's x and about its y, rolled by 45).
/// Consecutive views are neighbours, so that the arm moves little.
[[nodiscard]] std::array<Transform<Board, Camera>, kFixedViews> fixed_views(const CameraIntrinsics& camera,
                                                                            const BoardSpec& board,
                                                                            const Transform<Camera, Board>& first,
                                                                            double margin_px);

/// The first view of the list from number `next` on that the arm can reach inside the free space, with the board whole
/// in the picture and not hidden; `next` is then the number after it. The list goes by the first of the views taken, or
/// by `current`, from where the board is seen, when there is none. kNoneFeasible when none is left. Covariances are
/// those that the model predicts. Errors: kStartBlocked when `current` is not free.
[[nodiscard]] Result<CalibrationViewChoice> next_fixed_view(const CalibrationViewInputs& inputs, Planner& planner,
                                                            const JointVector& current, int& next,
                                                            const CalibrationViewOptions& options = {});

}  // namespace firstlook
