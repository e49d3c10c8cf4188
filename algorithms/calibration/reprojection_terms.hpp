/// The reprojection error of one corner as a function of hand-eye transform, board pose, arm pose and the camera's
/// intrinsics.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "platform/core/camera_intrinsics.hpp"

namespace firstlook {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Matrix12x6d = Eigen::Matrix<double, 12, 6>;

/// The three poses between the camera's pixels and the board.
struct ViewGeometry {
  Pose flange_T_camera = Pose::Identity();
  Pose base_T_board = Pose::Identity();
  Pose base_T_flange = Pose::Identity();
};

/// Pixel of a corner, and its derivatives by a small further pose_difference of each pose (px for each m and rad).
/// Those by the intrinsics are intrinsics_jacobian of `normalized`, for whoever estimates them.
struct CornerTerm {
  Eigen::Vector2d pixel;
  Eigen::Vector2d normalized;  ///< in the camera, without distortion
  Eigen::Matrix<double, 2, 6> d_hand_eye, d_board, d_arm;
};

/// Empty when the corner has no image.
[[nodiscard]] std::optional<CornerTerm> corner_term(const CameraIntrinsics& camera, const ViewGeometry& geometry,
                                                    const Eigen::Vector3d& corner_in_board);

/// Normal equations of one view over (hand-eye, board) = "global" and its own arm deviation.
struct ViewNormal {
  Matrix12d global = Matrix12d::Zero();
  Matrix12x6d global_arm = Matrix12x6d::Zero();
  Matrix6d arm = Matrix6d::Zero();
  Vector12d global_right = Vector12d::Zero();
  Vector6d arm_right = Vector6d::Zero();

  static constexpr int kGlobal = 12;
  /// Adds a corner with its residual (observed minus predicted, px) and weight (1 / px^2).
  void add(const CornerTerm& term, const Eigen::Vector2d& residual, double weight);
};

/// What a view adds to the normal equations where intrinsics are estimated, in the order of IntrinsicsVector.
struct IntrinsicsNormal {
  Eigen::Matrix<double, 12, 9> global = Eigen::Matrix<double, 12, 9>::Zero();  ///< with (hand-eye, board)
  Eigen::Matrix<double, 9, 6> arm = Eigen::Matrix<double, 9, 6>::Zero();       ///< with the arm's deviation
  Eigen::Matrix<double, 9, 9> own = Eigen::Matrix<double, 9, 9>::Zero();
  IntrinsicsVector right = IntrinsicsVector::Zero();

  /// Adds a corner beside ViewNormal::add.
  void add(const CornerTerm& term, const IntrinsicsJacobian& by_intrinsics, const Eigen::Vector2d& residual,
           double weight);
};

}  // namespace firstlook
