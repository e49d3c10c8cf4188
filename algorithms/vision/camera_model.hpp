/// The pinhole camera with plumb-bob distortion: from points to pixels and back.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "platform/core/camera_intrinsics.hpp"

namespace firstlook {

/// Points nearer than this to the camera's plane, or behind it, have no image.
inline constexpr double kProjectionDepthMin_m = 1e-6;

/// A pixel with its derivative by the point in camera coordinates (px for each metre).
struct ProjectionJacobian {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> d_pixel_d_point;
};

/// Distorts a normalised image point (x/z, y/z). Brown 1966 with OpenCV's order of coefficients.
[[nodiscard]] Eigen::Vector2d distort(const CameraIntrinsics& camera, const Eigen::Vector2d& normalized);

/// The 2x2 derivative of distort().
[[nodiscard]] Eigen::Matrix2d distort_jacobian(const CameraIntrinsics& camera, const Eigen::Vector2d& normalized);

/// The pixel (centres at integers, it may lie outside the image) where the camera sees a point given in metres in its
/// optical frame. Empty for a point behind the camera, not finite, or so far out that the distortion polynomial has
/// folded back and would put it into the picture.
[[nodiscard]] std::optional<Eigen::Vector2d> project(const CameraIntrinsics& camera, const Eigen::Vector3d& point_m);
[[nodiscard]] std::optional<ProjectionJacobian> project_with_jacobian(const CameraIntrinsics& camera,
                                                                      const Eigen::Vector3d& point_m);

/// The normalised, undistorted point (x/z, y/z) that is seen at `pixel`, by Newton's method to 1e-12. Empty where the
/// distortion cannot be inverted (far outside the image, or nonsense coefficients).
[[nodiscard]] std::optional<Eigen::Vector2d> undistort(const CameraIntrinsics& camera, const Eigen::Vector2d& pixel);

/// True when the pixel lies in the image at least `margin_px` from its edge.
[[nodiscard]] bool in_image(const CameraIntrinsics& camera, const Eigen::Vector2d& pixel, double margin_px = 0);

/// True for finite numbers, positive focal lengths and a positive image size.
[[nodiscard]] bool is_usable(const CameraIntrinsics& camera);

}  // namespace firstlook
