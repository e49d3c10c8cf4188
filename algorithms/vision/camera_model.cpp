#include "algorithms/vision/camera_model.hpp"

#include <Eigen/LU>
#include <cmath>

namespace firstlook {
namespace {

/// d(r_distorted)/dr = 1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3 with s = r^2.
double radial_slope(const CameraIntrinsics& c, double s) { return 1 + s * (3 * c.k1 + s * (5 * c.k2 + s * 7 * c.k3)); }

/// True when the radial distortion grows all the way from the centre to radius^2 = s: beyond a fold the polynomial
/// brings far points back into the picture.
bool before_fold(const CameraIntrinsics& c, double s) {
  if (!(radial_slope(c, s) > 0)) return false;
  // The slope's own extrema, 3 k1 + 10 k2 s + 21 k3 s^2 = 0, where they lie inside (0, s).
  const double a = 21 * c.k3, b = 10 * c.k2, d = 3 * c.k1;
  const auto dips = [&](double root) { return root > 0 && root < s && radial_slope(c, root) <= 0; };
  if (a == 0) return b == 0 || !dips(-d / b);
  const double discriminant = b * b - 4 * a * d;
  if (discriminant < 0) return true;
  const double root = std::sqrt(discriminant);
  return !dips((-b + root) / (2 * a)) && !dips((-b - root) / (2 * a));
}

}  // namespace

Eigen::Vector2d distort(const CameraIntrinsics& camera, const Eigen::Vector2d& normalized) {
  const double x = normalized.x(), y = normalized.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
  return {x * radial + 2 * camera.p1 * x * y + camera.p2 * (r2 + 2 * x * x),
          y * radial + camera.p1 * (r2 + 2 * y * y) + 2 * camera.p2 * x * y};
}

Eigen::Matrix2d distort_jacobian(const CameraIntrinsics& camera, const Eigen::Vector2d& normalized) {
  const double x = normalized.x(), y = normalized.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (camera.k1 + r2 * (camera.k2 + r2 * camera.k3));
  const double slope = 2 * (camera.k1 + r2 * (2 * camera.k2 + r2 * 3 * camera.k3));  // d radial / d r2, twice
  Eigen::Matrix2d j;
  j(0, 0) = radial + slope * x * x + 2 * camera.p1 * y + 6 * camera.p2 * x;
  j(0, 1) = slope * x * y + 2 * camera.p1 * x + 2 * camera.p2 * y;
  j(1, 0) = j(0, 1);
  j(1, 1) = radial + slope * y * y + 6 * camera.p1 * y + 2 * camera.p2 * x;
  return j;
}

IntrinsicsJacobian intrinsics_jacobian(const CameraIntrinsics& camera, const Eigen::Vector2d& normalized) {
  const double x = normalized.x(), y = normalized.y();
  const double r2 = x * x + y * y;
  const Eigen::Vector2d distorted = distort(camera, normalized);
  IntrinsicsJacobian j;
  j.row(0) << distorted.x(), 0, 1, 0, x * r2, x * r2 * r2, 2 * x * y, r2 + 2 * x * x, x * r2 * r2 * r2;
  j.row(1) << 0, distorted.y(), 0, 1, y * r2, y * r2 * r2, r2 + 2 * y * y, 2 * x * y, y * r2 * r2 * r2;
  j.row(0).tail<5>() *= camera.fx;
  j.row(1).tail<5>() *= camera.fy;
  return j;
}

IntrinsicsVector intrinsics_vector(const CameraIntrinsics& c) {
  IntrinsicsVector numbers;
  numbers << c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3;
  return numbers;
}

CameraIntrinsics with_intrinsics(const CameraIntrinsics& camera, const IntrinsicsVector& n) {
  return {camera.width, camera.height, n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8]};
}

std::optional<Eigen::Vector2d> project(const CameraIntrinsics& camera, const Eigen::Vector3d& point_m) {
  if (!point_m.allFinite() || point_m.z() < kProjectionDepthMin_m) return std::nullopt;
  const Eigen::Vector2d normalized = point_m.head<2>() / point_m.z();
  if (!before_fold(camera, normalized.squaredNorm())) return std::nullopt;
  const Eigen::Vector2d d = distort(camera, normalized);
  return Eigen::Vector2d(camera.fx * d.x() + camera.cx, camera.fy * d.y() + camera.cy);
}

std::optional<ProjectionJacobian> project_with_jacobian(const CameraIntrinsics& camera,
                                                        const Eigen::Vector3d& point_m) {
  const auto pixel = project(camera, point_m);
  if (!pixel) return std::nullopt;
  const double inverse = 1 / point_m.z();
  const Eigen::Vector2d normalized = point_m.head<2>() * inverse;
  Eigen::Matrix<double, 2, 3> d_normalized;
  d_normalized << inverse, 0, -normalized.x() * inverse, 0, inverse, -normalized.y() * inverse;
  const Eigen::Vector2d focal(camera.fx, camera.fy);
  return ProjectionJacobian{*pixel, normalized,
                            focal.asDiagonal() * distort_jacobian(camera, normalized) * d_normalized};
}

std::optional<Eigen::Vector2d> undistort(const CameraIntrinsics& camera, const Eigen::Vector2d& pixel) {
  constexpr int kIterationsMax = 50;
  constexpr double kResidualMax = 1e-12;
  const Eigen::Vector2d distorted((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy);
  Eigen::Vector2d x = distorted;
  // A damped Newton step: halved while it would jump over the fold.
  for (int i = 0; i < kIterationsMax; ++i) {
    const Eigen::Vector2d residual = distorted - distort(camera, x);
    if (!residual.allFinite()) return std::nullopt;
    if (residual.norm() <= kResidualMax * (1 + distorted.norm())) {
      return before_fold(camera, x.squaredNorm()) ? std::optional(x) : std::nullopt;
    }
    const Eigen::Matrix2d j = distort_jacobian(camera, x);
    if (!(std::abs(j.determinant()) > 1e-12)) return std::nullopt;
    Eigen::Vector2d step = j.inverse() * residual;
    for (int halving = 0; halving < 20; ++halving) {
      if ((distorted - distort(camera, x + step)).norm() < residual.norm()) break;
      step /= 2;
    }
    x += step;
  }
  return std::nullopt;
}

bool in_image(const CameraIntrinsics& camera, const Eigen::Vector2d& pixel, double margin_px) {
  return pixel.x() >= margin_px && pixel.y() >= margin_px && pixel.x() <= camera.width - 1 - margin_px &&
         pixel.y() <= camera.height - 1 - margin_px;
}

bool is_usable(const CameraIntrinsics& c) {
  const bool finite = std::isfinite(c.fx) && std::isfinite(c.fy) && std::isfinite(c.cx) && std::isfinite(c.cy) &&
                      std::isfinite(c.k1) && std::isfinite(c.k2) && std::isfinite(c.p1) && std::isfinite(c.p2) &&
                      std::isfinite(c.k3);
  return finite && c.fx > 0 && c.fy > 0 && c.width > 0 && c.height > 0;
}

}  // namespace firstlook
