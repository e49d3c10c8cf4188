/// The plane of a board in a depth image, as numbers in which a structured-light sensor's noise is the same everywhere.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/vision/target.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

/// A plane in the depth camera: 1/z = inverse_depth . (x/z, y/z, 1), exact for a flat board. Disparity is proportional
/// to 1/z, so a depth sigma that grows as sigma_at_1m * z^2 is the constant sigma_at_1m of 1/z, and rounding to steps
/// of disparity leaves no bias.
struct BoardPlane {
  Eigen::Vector3d inverse_depth = Eigen::Vector3d::Zero();     ///< 1/m
  Eigen::Matrix3d unit_information = Eigen::Matrix3d::Zero();  ///< of inverse_depth for noise of 1/m on each 1/z
  double noise = 0;                                            ///< sigma of 1/z (1/m), from the pixels' scatter
  int pixels = 0;                                              ///< that lie on the plane
  double share = 0;                                            ///< of the pixels where the board should be
};

struct BoardPlaneOptions {
  double noise_at_1m = 0.00285;  ///< stated sigma of a depth at 1 m (m); what scatters four times as much is no plane
  double edge_margin_m = 0.010;  ///< the outer points of the board less so much on every side
  double wrong_max_m = 0.04;     ///< farther than this before or behind the expected plane is not the board
  int pixels_max = 4096;         ///< evenly spread
  int pixels_min = 60;
  double share_min = 0.6;  ///< less than this of the expected pixels on one plane: something covers the board
};

/// The board's plane in a depth image. Pixels are taken from inside the outer points of the board as
/// `depth_T_board_expected` puts them; least median of squares (Rousseeuw 1984) finds the plane among hands and
/// dropouts, least squares over its pixels refines it. Deterministic; about 1 ms.
/// @param image  of the size of `camera`
/// @return kBoardNotFound with the reason: no return, board beside the picture, covered, not flat
[[nodiscard]] Result<BoardPlane> find_board_plane(const DepthImage& image, const CameraIntrinsics& camera,
                                                  const BoardSpec& board,
                                                  const Transform<Depth, Board>& depth_T_board_expected,
                                                  const BoardPlaneOptions& options = {});

/// One plane of several images of a standing camera. At least one.
[[nodiscard]] BoardPlane merged(std::span<const BoardPlane> planes);

/// The same plane as a known pose of the board makes it, with its derivatives; both poses' differences are those of
/// pose_difference. Empty result means that the plane goes through the depth camera or lies behind it.
struct ExpectedPlane {
  Eigen::Vector3d inverse_depth;
  Eigen::Matrix<double, 3, 6> by_camera_T_depth;
  Eigen::Matrix<double, 3, 6> by_camera_T_board;
};
[[nodiscard]] std::optional<ExpectedPlane> expected_plane(const Pose& camera_T_depth, const Pose& camera_T_board);

}  // namespace firstlook
