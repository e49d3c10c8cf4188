/// The pinhole camera with plumb-bob distortion: from points to pixels and back.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "platform/core/camera_intrinsics.hpp"

namespace firstlook {

/// Points nearer than this to the camera's plane, or behind it, have no image.
inline constexpr double kProjectionDepthMin_m = 1e-6;

/// The numbers of a camera in the order fx, fy, cx, cy (px), k1, k2, p1, p2, k3.
using IntrinsicsVector = Eigen::Matrix<double, 9, 1>;
/// Derivative of a pixel by them.
using IntrinsicsJacobian = Eigen::Matrix<double, 2, 9>;

/// A pixel with its derivative by the point in camera coordinates (px for each metre).
struct ProjectionJacobian {
  Eigen::Vector2d pixel;
  Eigen::Vector2d normalized;  ///< the point's x/z, y/z
  Eigen::Matrix<double, 2, 3> d_pixel_d_point;
};

/// Distorts a normalised image point (x/z, y/z). Brown 1966 with OpenCV's order of coefficients.
[[nodiscard]] Eigen::Vector2d distort(const CameraIntrinsics& camera, const Eigen::Vector2d& normalized);

/// The 2x2 derivative of distort().
[[nodiscard]] Eigen::Matrix2d distort_jacobian(const CameraIntrinsics& camera, const Eigen::Vector2d& normalized);

/// How the pixel of a normalised image point changes with the camera's numbers.
[[nodiscard]] IntrinsicsJacobian intrinsics_jacobian(const CameraIntrinsics& camera, const Eigen::Vector2d& normalized);

/// The camera's numbers as a vector, and a camera of the same picture size with other numbers.
[[nodiscard]] IntrinsicsVector intrinsics_vector(const CameraIntrinsics& camera);
[[nodiscard]] CameraIntrinsics with_intrinsics(const CameraIntrinsics& camera, const IntrinsicsVector& numbers);

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
