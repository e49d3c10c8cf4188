#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"
#include "algorithms/vision/rotation.hpp"

namespace firstlook::solvers {
namespace {

/// Dual part of the unit dual quaternion of a motion: half of translation times rotation.
Eigen::Vector4d dual_part(const Pose& motion, const Eigen::Vector4d& rotation) {
  Eigen::Vector4d t;
  t << 0, motion.translation() / 2;
  return left_product(t) * rotation;
}

Eigen::Matrix<double, 6, 8> equations(const Motion& m) {
  const Eigen::Vector3d a = m.qa.tail<3>(), b = m.qb.tail<3>();
  const Eigen::Vector3d a_dual = dual_part(m.a, m.qa).tail<3>(), b_dual = dual_part(m.b, m.qb).tail<3>();
  Eigen::Matrix<double, 6, 8> row = Eigen::Matrix<double, 6, 8>::Zero();
  row.block<3, 4>(0, 0) << a - b, cross_matrix(a + b);
  row.block<3, 4>(3, 0) << a_dual - b_dual, cross_matrix(a_dual + b_dual);
  row.block<3, 4>(3, 4) = row.block<3, 4>(0, 0);
  return row;
}

/// The combination of the two null vectors whose halves are perpendicular and whose first half is longest: a quadratic
/// equation in the ratio of the factors, solved here through the eigenvectors of its symmetric form, which
/// needs no special cases.
Eigen::Matrix<double, 8, 1> perpendicular_member(const Eigen::Matrix<double, 8, 2>& null_space) {
  const Eigen::Matrix<double, 4, 2> real = null_space.topRows<4>(), dual = null_space.bottomRows<4>();
  const Eigen::Matrix2d product = real.transpose() * dual;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen((product + product.transpose()) / 2);
  double low = eigen.eigenvalues()(0), high = eigen.eigenvalues()(1);
  if (low > 0) low = 0;  // noise has left no solution: the nearest
  if (high < 0) high = 0;
  const Eigen::Vector2d plus = eigen.eigenvectors() * Eigen::Vector2d(std::sqrt(high), std::sqrt(-low));
  const Eigen::Vector2d minus = eigen.eigenvectors() * Eigen::Vector2d(std::sqrt(high), -std::sqrt(-low));
  const auto share = [&](const Eigen::Vector2d& factors) {
    return (real * factors).norm() / std::max((null_space * factors).norm(), 1e-300);
  };
  return null_space * (share(plus) > share(minus) ? plus : minus);
}

}  // namespace

Result<HandEyeSolution> daniilidis(const Problem& problem) {
  RowStack<8> rows;
  for (const Motion& m : problem.motions) rows.add(equations(m));
  const Eigen::JacobiSVD<Eigen::Matrix<double, 8, 8>> svd(rows.triangle(), Eigen::ComputeFullV);
  const Eigen::Matrix<double, 8, 1> member = perpendicular_member(svd.matrixV().rightCols<2>());
  const double length = member.head<4>().norm();
  if (!(length > 1e-9 * member.norm())) {
    return failure(Fault::kDegenerateMotion, "no dual quaternion of a rigid motion meets the motions' equations");
  }
  const Eigen::Vector4d q = member.head<4>() / length;
  const Eigen::Vector4d dual = member.tail<4>() / length - q * q.dot(member.tail<4>()) / length;
  const Eigen::Vector3d t = (2 * (left_product(dual) * conjugate(q))).tail<3>();
  return HandEyeSolution{Transform<Flange, Camera>(make_pose(rotation_of(q), t)), {}, {}, {}};
}

}  // namespace firstlook::solvers
