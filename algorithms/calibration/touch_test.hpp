/// The true error of a hand-eye calibration: where the camera sees the board against where the arm's tip touched it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/calibration/touched_board.hpp"

namespace firstlook {

/// The calibration to be tested, and where it puts the board.
struct CalibratedBoard {
  Transform<Flange, Camera> flange_T_camera;
  Transform<Base, Board> base_T_board;
  Matrix6d covariance = Matrix6d::Zero();  ///< of base_T_board, see pose_difference
};

struct TouchTestLimits {
  double error_max_m = 0.01;    ///< of the camera's place, mean over the views: what a gripper usually forgives
  double error_max_rad = 0.02;  ///< of its rotation
  double significance = 0.001;  ///< share of right calibrations that the chi-square test turns down
};

/// Where the touched board puts the camera, as seen from where the arm and the hand-eye transform put it (thesis eq.
/// 8-4 to 8-6): (translation m, rotation vector rad), in the camera's axes, so that an error of the hand-eye transform
/// is the same in every view.
using CameraError = Vector6d;

struct TouchTest {
  TouchedBoard board;
  std::vector<CameraError> errors;                     ///< one for each view given
  CameraError mean = CameraError::Zero();              ///< over the places of the arm
  CameraError mean_sigma = CameraError::Zero();        ///< as expected of it: touches, board, scatter of the views
  CameraError view_deviation = CameraError::Zero();    ///< standard deviation over the places; 0 below two of them
  CameraError static_deviation = CameraError::Zero();  ///< the same over repeated looks from one place, all such places
                                                       ///< together; 0 without
  int places = 0;                                      ///< of the arm
  int static_looks = 0;                                ///< looks from places with two or more of them
  Vector6d shift = Vector6d::Zero();                   ///< pose_difference of the board: as touched minus as calibrated
  double chi2 = 0;                                     ///< of `shift` by both covariances, 6 degrees of freedom
  double chi2_limit = 0;
  [[nodiscard]] bool agrees() const { return reasons.empty(); }
  std::vector<std::string> reasons;  ///< why the calibration does not pass: figure and limit, likely mistakes
};

/// Compares the board as touched with the one that the calibration's views and the arm put in its place, and the
/// camera's pose both ways in each view. Views whose said flange poses differ by less than 50 um and 0.1 mrad are
/// repeated looks from one place. Three mistakes of the person who touches are named: corners counted from another
/// corner, another size of the squares, another tip than was said.
/// What it cannot show: an error of the arm that is the same where it looks and where it touches.
/// @param views  of this board, each as the camera saw it
[[nodiscard]] TouchTest test_by_touch(const BoardSpec& board, TouchedBoard touched, const CalibratedBoard& calibrated,
                                      std::span<const PosePair> views, const TouchTestLimits& limits = {});

}  // namespace firstlook
