#include "algorithms/vision/rotation.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace firstlook {

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& rotation_vector) {
  const double half = rotation_vector.norm() / 2;
  // sin(x)/x by its series where the quotient would lose digits.
  const double sinc = half < 1e-4 ? 1 - half * half / 6 : std::sin(half) / half;
  Eigen::Quaterniond q;
  q.w() = std::cos(half);
  q.vec() = rotation_vector * (sinc / 2);
  return q.normalized().toRotationMatrix();
}

Eigen::Vector3d rotation_log(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine < 1e-9) return 2 * q.vec();
  return q.vec() * (2 * std::atan2(sine, q.w()) / sine);
}

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& rotation_vector) {
  const double angle2 = rotation_vector.squaredNorm();
  const double angle = std::sqrt(angle2);
  const bool small = angle < 1e-3;
  const double a = small ? 0.5 - angle2 / 24 : (1 - std::cos(angle)) / angle2;
  const double b = small ? 1.0 / 6 - angle2 / 120 : (angle - std::sin(angle)) / (angle2 * angle);
  const Eigen::Matrix3d k = cross_matrix(rotation_vector);
  return Eigen::Matrix3d::Identity() + a * k + b * k * k;
}

Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& r) {
  // A camera that looks along the tool has its camera_link at a pitch of 90 degrees, where yaw and roll are known only
  // together: roll is taken from what is left after the yaw found, so that together they are right in any case.
  const double horizontal = std::hypot(r(0, 0), r(1, 0));
  const double pitch = std::atan2(-r(2, 0), horizontal);
  const double yaw = horizontal < 1e-12 ? 0.0 : std::atan2(r(1, 0), r(0, 0));
  const double c = std::cos(yaw), s = std::sin(yaw);
  const double roll = std::atan2(s * r(0, 2) - c * r(1, 2), c * r(1, 1) - s * r(0, 1));
  return {roll, pitch, yaw};
}

}  // namespace firstlook
