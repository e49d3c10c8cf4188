#include <Eigen/SVD>

#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"
#include "algorithms/vision/rotation.hpp"

namespace firstlook::solvers {
namespace {

using Matrix3x7d = Eigen::Matrix<double, 3, 7>;

/// Vector part of a p = q b times b's scalar, with q's scalar from the scalar part put in; p's scalar is 1. Columns:
/// the vectors of p and q, the right side.
Matrix3x7d equations(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
  const Eigen::Vector3d av = a.tail<3>(), bv = b.tail<3>();
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  Matrix3x7d row;
  row << b(0) * a(0) * identity + b(0) * cross_matrix(av) + bv * av.transpose(),
      -(b(0) * b(0) * identity + bv * bv.transpose() - b(0) * cross_matrix(bv)), a(0) * bv - b(0) * av;
  return row;
}

/// One of the 16 equal problems (a v) (v* p) = (q w*) (w b).
struct Turned {
  Eigen::Vector4d v, w;
  Eigen::Matrix<double, 7, 7> triangle;
  double weakest = -1;
};

Turned best_conditioned(std::span<const View> views) {
  Turned best;
  for (const Eigen::Vector4d& v : half_turns()) {
    for (const Eigen::Vector4d& w : half_turns()) {
      RowStack<7> rows;
      for (const View& view : views) rows.add(equations(left_product(view.qa) * v, left_product(w) * view.qb));
      Turned turned{v, w, rows.triangle(), 0};
      turned.weakest =
          Eigen::JacobiSVD<Eigen::Matrix<double, 6, 6>>(turned.triangle.topLeftCorner<6, 6>()).singularValues()(5);
      if (turned.weakest > best.weakest) best = turned;
    }
  }
  return best;
}

}  // namespace

Result<HandEyeSolution> zhuang(const Problem& problem) {
  const Turned turned = best_conditioned(problem.views);
  const auto x = solve_triangle(turned.triangle);
  if (!x) return no_one_solution("both rotations");
  Eigen::Vector4d p, q;
  p << 1, x->head<3>();
  q << 0, x->tail<3>();
  double sum = 0, weight = 0;
  for (const View& view : problem.views) {
    const Eigen::Vector4d a = left_product(view.qa) * turned.v, b = left_product(turned.w) * view.qb;
    sum += b(0) * (a(0) - a.tail<3>().dot(p.tail<3>()) + b.tail<3>().dot(q.tail<3>()));
    weight += b(0) * b(0);
  }
  q(0) = sum / weight;
  return solution_of_rotations(problem, rotation_of(left_product(turned.v) * p),
                               rotation_of(left_product(q) * turned.w));
}

}  // namespace firstlook::solvers
