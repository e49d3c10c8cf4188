/// Where a board with known corners stands in the camera.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "algorithms/vision/checkerboard.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/result.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

struct BoardPose {
  Transform<Camera, Board> camera_T_board;
  /// For corner noise of 1 px (multiply by its variance); translation m, rotation rad, both in the camera frame:
  /// t = t_est + d_t, R = Exp(d_r) R_est.
  Eigen::Matrix<double, 6, 6> unit_covariance = Eigen::Matrix<double, 6, 6>::Zero();
  double residual_rms_px = 0;  ///< for each coordinate
};

/// Pose of the board from all its corners (row by row): homography for the start (Zhang 2000), both members of the
/// planar ambiguity refined by Levenberg-Marquardt on the reprojection error, the better one kept. About 0.2 ms.
/// @return kBoardNotFound when the count is wrong, the corners do not fit within `residual_max_px`, or the board would
/// be behind the camera
[[nodiscard]] Result<BoardPose> estimate_board_pose(const CameraIntrinsics& camera, const BoardSpec& board,
                                                    std::span<const Eigen::Vector2d> corners_px,
                                                    double residual_max_px = 3.0);

/// A pose that single wrong corners do not move.
struct RobustBoardPose {
  BoardPose pose;                    ///< of the weighted corners
  std::vector<double> residuals_px;  ///< length of each corner's error
  std::vector<double> weights;       ///< Huber's, 0 to 1; 0 beyond ten sigmas
};

/// The same, corners beyond `loss_scale` sigmas (from the median residual, at least `sigma_min_px`) weighted down.
[[nodiscard]] Result<RobustBoardPose> estimate_board_pose_robust(const CameraIntrinsics& camera, const BoardSpec& board,
                                                                 std::span<const Eigen::Vector2d> corners_px,
                                                                 double residual_max_px = 5.0, double loss_scale = 3.0,
                                                                 double sigma_min_px = 0.01);

}  // namespace firstlook
