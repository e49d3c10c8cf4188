/// Exponential and logarithm of SO(3).
#pragma once

#include <Eigen/Core>

namespace firstlook {

/// The matrix of a rotation vector (rad), and back with an angle in [0, pi]; accurate at 0 and at pi.
[[nodiscard]] Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& rotation_vector);
[[nodiscard]] Eigen::Vector3d rotation_log(const Eigen::Matrix3d& rotation);

/// v x w as a matrix times w.
[[nodiscard]] Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// Left Jacobian of SO(3): Exp(phi + d) = Exp(J_l(phi) d) Exp(phi) to first order (Sola et al. 2018, eq. 145).
[[nodiscard]] Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& rotation_vector);

/// Roll, pitch and yaw (rad) of R = Rz(yaw) Ry(pitch) Rx(roll), as URDF has them; yaw is 0 where it is not determined.
[[nodiscard]] Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& rotation);

}  // namespace firstlook
