/// Touches of a board made from a known truth and a known hand.
#pragma once

#include <numbers>
#include <vector>

#include "algorithms/calibration/touched_board.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

namespace firstlook::test {

/// Who touches, and with what.
struct Toucher {
  Eigen::Vector3d flange_p_tip_m{0.021, -0.013, 0.14};  ///< the truth
  double hand_sigma_m = 3e-4;
  double tilt_max_rad = 25 * kDegree;
  Eigen::Vector3d tilt_axes{1, 1, 1};  ///< about the flange's axes: which of them
};

/// Corners spread over the board: every `step`-th column and row, and the last ones.
inline std::vector<int> spread_corners(const BoardSpec& board, int step) {
  std::vector<int> corners;
  for (int row = 0; row < board.inner_rows; row += step) {
    for (int column = 0; column < board.inner_columns; column += step) {
      corners.push_back(row * board.inner_columns + column);
    }
  }
  return corners;
}

/// What the arm says while the tip stands on each corner. Its deviation is the same for all of them, or each its own.
inline std::vector<Touch> touch(const Setup& s, const Toucher& toucher, const std::vector<int>& corners, Random& random,
                                bool arm_deviates_together = true) {
  std::vector<Touch> touches;
  Vector6d deviation = arm_noise(s.arm_sigma, random);
  for (const int corner : corners) {
    if (!arm_deviates_together) deviation = arm_noise(s.arm_sigma, random);
    Eigen::Vector3d tilt;
    for (Eigen::Index i = 0; i < 3; ++i) {
      tilt[i] = toucher.tilt_axes[i] * random.uniform(-toucher.tilt_max_rad, toucher.tilt_max_rad);
    }
    Pose flange = Pose::Identity();
    flange.linear() = s.base_T_board.linear() * rotation_exp(tilt);
    const Eigen::Vector3d tip = s.base_T_board * s.board.corner(corner) + toucher.hand_sigma_m * random.normal3();
    flange.translation() = tip - flange.linear() * toucher.flange_p_tip_m;
    touches.push_back({Transform<Base, Flange>(perturb(flange, deviation)), corner});
  }
  return touches;
}

/// The tip as somebody measures it with the given sigma.
inline TipOffset measured_tip(const Toucher& toucher, double sigma_m, Random& random) {
  return {toucher.flange_p_tip_m + sigma_m * random.normal3(), sigma_m};
}

}  // namespace firstlook::test
