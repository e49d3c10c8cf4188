/// Pieces that several hand-eye solvers share.
#pragma once

#include <Eigen/Core>
#include <Eigen/QR>
#include <array>
#include <optional>
#include <span>
#include <string_view>

#include "algorithms/calibration/solvers/problem.hpp"

namespace firstlook::solvers {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Matrix3x9d = Eigen::Matrix<double, 3, 9>;

/// Any number of equations in N unknowns (or N - 1 and a right side in the last column), kept as the N x N triangle of
/// their QR factorisation: least squares without squaring the condition number, in memory that does not grow.
template <int N>
class RowStack {
 public:
  using Triangle = Eigen::Matrix<double, N, N>;

  template <typename Rows>
  void add(const Eigen::MatrixBase<Rows>& rows) {
    if (used_ + rows.rows() > kRows) reduce();
    buffer_.middleRows(used_, rows.rows()) = rows;
    used_ += rows.rows();
  }
  /// Upper triangular T with T^T T = sum of the rows' outer products.
  [[nodiscard]] const Triangle& triangle() {
    reduce();
    return triangle_;
  }

 private:
  static constexpr Eigen::Index kRows = N + 120;

  void reduce() {
    if (used_ == N && reduced_) return;
    for (; used_ < N; ++used_) buffer_.row(used_).setZero();
    const Eigen::HouseholderQR<Eigen::Matrix<double, Eigen::Dynamic, N>> qr(buffer_.topRows(used_));
    triangle_ = qr.matrixQR().template topRows<N>().template triangularView<Eigen::Upper>();
    buffer_.template topRows<N>() = triangle_;
    used_ = N;
    reduced_ = true;
  }

  Eigen::Matrix<double, Eigen::Dynamic, N> buffer_ = Eigen::Matrix<double, Eigen::Dynamic, N>::Zero(kRows, N);
  Triangle triangle_ = Triangle::Zero();
  Eigen::Index used_ = 0;
  bool reduced_ = false;
};

/// Least squares solution of a triangle whose last column is the right side; empty when the columns, each scaled to
/// length 1, have a condition number beyond 1e10.
[[nodiscard]] std::optional<Eigen::VectorXd> solve_triangle(const Eigen::MatrixXd& triangle);

/// Unit vector that the triangle maps to the shortest one.
[[nodiscard]] Eigen::VectorXd null_vector(const Eigen::MatrixXd& triangle);

/// The rotation nearest to m in the Frobenius norm (Arun, Huang and Blostein 1987; Umeyama 1991 for the sign).
[[nodiscard]] Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

/// Columns one below the other, and back.
[[nodiscard]] Vector9d vec(const Eigen::Matrix3d& m);
[[nodiscard]] Eigen::Matrix3d unvec(const Vector9d& v);

/// Kronecker product: kronecker(b^T, a) vec(x) = vec(a x b).
[[nodiscard]] Matrix9d kronecker(const Eigen::Matrix3d& left, const Eigen::Matrix3d& right);
/// kronecker(v^T, a) vec(x) = a x v.
[[nodiscard]] Matrix3x9d kronecker(const Eigen::Vector3d& left, const Eigen::Matrix3d& right);

/// Quaternions as (w, x, y, z): left_product(a) b = a b = right_product(b) a.
[[nodiscard]] Eigen::Matrix4d left_product(const Eigen::Vector4d& a);
[[nodiscard]] Eigen::Matrix4d right_product(const Eigen::Vector4d& b);
[[nodiscard]] Eigen::Vector4d conjugate(const Eigen::Vector4d& q);
[[nodiscard]] Eigen::Matrix3d rotation_of(const Eigen::Vector4d& q);  ///< q of any length but 0

/// The quaternions of no turn and of half turns about x, y and z. Of a rotation followed by each of them at least one
/// product turns by 120 degrees or less: formulas that fail at 180 degrees are applied to that one.
[[nodiscard]] const std::array<Eigen::Vector4d, 4>& half_turns();

/// Vectors along the axes of a flange's and a camera's motion, as long as a sine of half the angle times any factor.
struct AxisPair {
  Eigen::Vector3d a, b;
};
/// The rotation with a = R b, by the linear equations (a + b) x z = b - a for z = axis tan(angle / 2) in the least
/// squares sense. z grows without bound towards 180 degrees: the camera's axes are first turned by the one of
/// half_turns() for which the equations are best conditioned. Empty when even that has no one solution.
[[nodiscard]] std::optional<Eigen::Matrix3d> rotation_by_half_tangent(std::span<const AxisPair> axes);

/// The two parts of a rotation that takes axis k_b to axis k_a: R = along + cos(phi) across + sin(phi) turned, phi the
/// unknown turn about the axis.
struct AxisFamily {
  Eigen::Matrix3d along, across, turned;
};
[[nodiscard]] AxisFamily axis_family(const Eigen::Vector3d& axis_a, const Eigen::Vector3d& axis_b);

[[nodiscard]] Pose make_pose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation);
[[nodiscard]] Matrix3x4d raw_matrix(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation);

/// The error of a linear system that leaves something open.
[[nodiscard]] std::unexpected<Error> no_one_solution(std::string_view of_what);

/// flange_T_camera by a known rotation: (R_A - I) t = R t_B - t_A over all motions.
[[nodiscard]] Result<HandEyeSolution> solution_of_rotation(const Problem& problem, const Eigen::Matrix3d& rotation);
/// flange_T_camera and base_T_board by known rotations: R_A t_P - t_Q = R_Q t_B - t_A over all views.
[[nodiscard]] Result<HandEyeSolution> solution_of_rotations(const Problem& problem, const Eigen::Matrix3d& rotation_p,
                                                            const Eigen::Matrix3d& rotation_q);

}  // namespace firstlook::solvers
