#include "algorithms/calibration/camera_on_arm.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/calibration/board_ambiguity.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/rotation.hpp"

namespace firstlook {
namespace {

/// Sum of the squared shifts of all corners, px^2.
double shift2(const CameraIntrinsics& camera, const BoardSpec& board, const BoardPose& before, const BoardPose& after) {
  constexpr double kLost_px = 1e3;  // a corner that has no image any more has moved
  double squared = 0;
  for (int i = 0; i < board.corners(); ++i) {
    const auto a = project(camera, before.camera_T_board * board.corner(i));
    const auto b = project(camera, after.camera_T_board * board.corner(i));
    squared += a && b ? (*a - *b).squaredNorm() : kLost_px * kLost_px;
  }
  return squared;
}

}  // namespace

ViewChange compare_views(const CameraIntrinsics& camera, const BoardSpec& board, const BoardPose& before,
                         const BoardPose& after, double corner_sigma_px) {
  constexpr double kShiftMin_px = 1.0;  // vibration and light change corners by less
  constexpr double kSigmas = 8;
  ViewChange change;
  BoardPose now = after;
  double squared = shift2(camera, board, before, now);
  if (!board.is_orientation_unique()) {  // a small motion may make the other end the first
    BoardPose turned = after;
    turned.camera_T_board = after.camera_T_board * half_turn(board);
    const double squared_turned = shift2(camera, board, before, turned);
    if (squared_turned < squared) now = turned, squared = squared_turned;
  }
  change.shift_rms_px = std::sqrt(squared / board.corners());
  const auto moved = before.camera_T_board.inverse() * now.camera_T_board;
  change.rotation_rad = rotation_log(moved.rotation()).norm();
  change.translation_m = (now.camera_T_board * board.center() - before.camera_T_board * board.center()).norm();
  change.changed = change.shift_rms_px > std::max(kShiftMin_px, kSigmas * corner_sigma_px);
  return change;
}

}  // namespace firstlook
