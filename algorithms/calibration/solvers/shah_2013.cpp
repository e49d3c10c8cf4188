#include <cmath>

#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {
namespace {

/// Scaled to determinant 1, then made orthonormal.
Eigen::Matrix3d rotation_of_singular_vector(const Vector9d& v) {
  const Eigen::Matrix3d m = unvec(v);
  return nearest_rotation(m / std::cbrt(m.determinant()));
}

}  // namespace

Result<HandEyeSolution> shah(const Problem& problem) {
  // The leading singular vectors of sum of R_B (x) R_A are the null vector of these rows, which keep twice the digits
  // when motions are small.
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  RowStack<18> rows;
  for (const View& view : problem.views) {
    Eigen::Matrix<double, 9, 18> row;
    row << kronecker(identity, view.a.linear()), -kronecker(Eigen::Matrix3d(view.b.linear().transpose()), identity);
    rows.add(row);
  }
  const Eigen::VectorXd both = null_vector(rows.triangle());
  return solution_of_rotations(problem, rotation_of_singular_vector(both.head<9>()),
                               rotation_of_singular_vector(both.tail<9>()));
}

}  // namespace firstlook::solvers
