/// Where a board with known corners stands in the camera.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "algorithms/vision/target.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/result.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

/// The second pose of a plane that looks nearly the same, its normal on the other side of the line of sight.
struct OtherPose {
  Transform<Camera, Board> camera_T_board;
  double residual_rms_px = 0;  ///< of the estimate never less than the first's: how much less likely it is
  Eigen::Matrix<double, 6, 6> unit_covariance = Eigen::Matrix<double, 6, 6>::Zero();  ///< as BoardPose's
};

struct BoardPose {
  Transform<Camera, Board> camera_T_board;
  /// For corner noise of 1 px (multiply by its variance); translation m, rotation rad, both in the camera frame:
  /// t = t_est + d_t, R = Exp(d_r) R_est.
  Eigen::Matrix<double, 6, 6> unit_covariance = Eigen::Matrix<double, 6, 6>::Zero();
  double residual_rms_px = 0;      ///< for each coordinate
  std::optional<OtherPose> other;  ///< of the planar ambiguity; empty when both ways end in one pose
};

/// The other camera_T_board of a plane that looks nearly the same: its normal mirrored at the line of sight
/// (Schweighofer and Pinz 2006), its centre kept.
[[nodiscard]] Pose mirrored_pose(const Pose& pose, const Eigen::Vector3d& center_in_board);

/// Pose of the board from its points, all or some: homography for the start (Zhang 2000), both members of the
/// planar ambiguity refined by Levenberg-Marquardt on the reprojection error, the better one first. About 0.2 ms.
/// @return kBoardNotFound when the points are not points of the board or too few, the corners do not fit within
/// `residual_max_px`, or the board would be behind the camera
[[nodiscard]] Result<BoardPose> estimate_board_pose(const CameraIntrinsics& camera, const BoardSpec& board,
                                                    const SeenPoints& points, double residual_max_px = 3.0);

/// A pose that single wrong corners do not move.
struct RobustBoardPose {
  BoardPose pose;                    ///< of the weighted corners
  std::vector<double> residuals_px;  ///< length of each corner's error
  std::vector<double> weights;       ///< Huber's, 0 to 1; 0 beyond ten sigmas
};

/// The same, corners beyond `loss_scale` sigmas (from the median residual, at least `sigma_min_px`) weighted down.
[[nodiscard]] Result<RobustBoardPose> estimate_board_pose_robust(const CameraIntrinsics& camera, const BoardSpec& board,
                                                                 const SeenPoints& points, double residual_max_px = 5.0,
                                                                 double loss_scale = 3.0, double sigma_min_px = 0.01);

}  // namespace firstlook
