/// What a view of the board would add to the calibration, before the arm moves there.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "algorithms/calibration/hand_eye_refinement.hpp"
#include "algorithms/calibration/reprojection_terms.hpp"

namespace firstlook {

/// The present belief. A rough hand-eye from three views, or even from the drawing, is good enough.
struct ViewDesignModel {
  CameraIntrinsics camera;
  BoardSpec board;
  Transform<Flange, Camera> flange_T_camera;
  Transform<Base, Board> base_T_board;
  double corner_sigma_px = 0.1;
  ArmSigma arm_sigma{1e-4, 2e-4};
};

struct ViewLimits {
  double margin_px = 25;        ///< of every corner from the image's edge
  double tilt_max_rad = 0.87;   ///< between the board's normal and the line of sight (50 degrees)
  double distance_min_m = 0.2;  ///< camera to the board's centre
  double distance_max_m = 1.5;
  double spacing_min_px = 8;  ///< between neighbouring corners: below it the detector fails
};

enum class ViewFault : std::uint8_t { kNone, kBehind, kOutOfImage, kTilt, kDistance, kSpacing };

/// Whether the whole board would be seen well with the flange at `base_T_flange`. About 1 us.
[[nodiscard]] ViewFault check_view(const ViewDesignModel& model, const Transform<Base, Flange>& base_T_flange,
                                   const ViewLimits& limits = {});

/// Information (inverse covariance) that a view adds about flange_T_camera (first six) and base_T_board (last six), in
/// the terms of pose_difference, its own arm deviation marginalised. Zero when a corner lies behind the camera. About
/// 20 us for 54 corners. Informations of views add up.
[[nodiscard]] Matrix12d view_information(const ViewDesignModel& model, const Transform<Base, Flange>& base_T_flange);

/// What is known before any view: wide enough to say nothing, and enough to make every sum invertible.
[[nodiscard]] Matrix12d prior_information();

/// Covariance of flange_T_camera after views whose informations sum up to `information` (the prior included), the
/// board's pose marginalised.
[[nodiscard]] Matrix6d predicted_covariance(const Matrix12d& information);

/// A-optimal cost of a covariance: trace of the translation part plus lever^2 times the trace of the rotation part,
/// m^2.
[[nodiscard]] double design_cost(const Matrix6d& covariance, double lever_m = 1.0);

/// D-optimal cost of a covariance: the sixth root of its determinant, m rad. Unlike design_cost it tells views
/// apart while some direction is still open: that direction's share is the same factor for all of them.
[[nodiscard]] double design_volume(const Matrix6d& covariance);

/// The same with several targets, each with a model of its own that shares camera, hand-eye and sigmas with the others:
/// information about flange_T_camera (first six) and base_T_board of each model in their order, added by one place of
/// the arm from which those of the bit mask `shown` are seen. What is seen from one place shares the arm's deviation.
[[nodiscard]] Eigen::MatrixXd joint_view_information(std::span<const ViewDesignModel> models, std::uint32_t shown,
                                                     const Transform<Base, Flange>& base_T_flange);
[[nodiscard]] Eigen::MatrixXd joint_prior_information(std::size_t targets);
/// Covariance of flange_T_camera; and of all that the information is about.
[[nodiscard]] Matrix6d predicted_hand_eye(const Eigen::MatrixXd& information);
[[nodiscard]] Eigen::MatrixXd predicted_joint(const Eigen::MatrixXd& information);

/// design_cost after one more view at `candidate`: smaller is better. About 25 us.
[[nodiscard]] double predicted_cost(const ViewDesignModel& model, const Matrix12d& information,
                                    const Transform<Base, Flange>& candidate, double lever_m = 1.0);

}  // namespace firstlook
