#include "algorithms/calibration/solvers/algebra.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "algorithms/vision/rotation.hpp"

namespace firstlook::solvers {

std::optional<Eigen::VectorXd> solve_triangle(const Eigen::MatrixXd& triangle) {
  constexpr double kConditionMax = 1e10;
  const Eigen::Index n = triangle.cols() - 1;
  const Eigen::VectorXd scale = triangle.topLeftCorner(n, n).colwise().norm();
  if (!(scale.minCoeff() > 0)) return std::nullopt;
  const Eigen::MatrixXd scaled = triangle.topLeftCorner(n, n) * scale.cwiseInverse().asDiagonal();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(scaled);
  if (!(svd.singularValues()(n - 1) * kConditionMax > svd.singularValues()(0))) return std::nullopt;
  // Back substitution keeps digits where equations of very different weight meet; the decomposition above would not.
  return scale.cwiseInverse().asDiagonal() *
         Eigen::VectorXd(scaled.triangularView<Eigen::Upper>().solve(triangle.col(n).head(n)));
}

Eigen::VectorXd null_vector(const Eigen::MatrixXd& triangle) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(triangle, Eigen::ComputeFullV);
  return svd.matrixV().col(triangle.cols() - 1);
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

Vector9d vec(const Eigen::Matrix3d& m) {
  Vector9d v;
  v << m.col(0), m.col(1), m.col(2);
  return v;
}

Eigen::Matrix3d unvec(const Vector9d& v) {
  Eigen::Matrix3d m;
  m << v.head<3>(), v.segment<3>(3), v.tail<3>();
  return m;
}

Matrix9d kronecker(const Eigen::Matrix3d& left, const Eigen::Matrix3d& right) {
  Matrix9d product;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) product.block<3, 3>(3 * i, 3 * j) = left(i, j) * right;
  }
  return product;
}

Matrix3x9d kronecker(const Eigen::Vector3d& left, const Eigen::Matrix3d& right) {
  Matrix3x9d product;
  product << left.x() * right, left.y() * right, left.z() * right;
  return product;
}

Eigen::Matrix4d left_product(const Eigen::Vector4d& a) {
  Eigen::Matrix4d m;
  m << a(0), -a(1), -a(2), -a(3),  //
      a(1), a(0), -a(3), a(2),     //
      a(2), a(3), a(0), -a(1),     //
      a(3), -a(2), a(1), a(0);
  return m;
}

Eigen::Matrix4d right_product(const Eigen::Vector4d& b) {
  Eigen::Matrix4d m;
  m << b(0), -b(1), -b(2), -b(3),  //
      b(1), b(0), b(3), -b(2),     //
      b(2), -b(3), b(0), b(1),     //
      b(3), b(2), -b(1), b(0);
  return m;
}

Eigen::Vector4d conjugate(const Eigen::Vector4d& q) { return {q(0), -q(1), -q(2), -q(3)}; }

Eigen::Matrix3d rotation_of(const Eigen::Vector4d& q) {
  return Eigen::Quaterniond(q(0), q(1), q(2), q(3)).normalized().toRotationMatrix();
}

const std::array<Eigen::Vector4d, 4>& half_turns() {
  static const std::array<Eigen::Vector4d, 4> turns = {Eigen::Vector4d::Unit(0), Eigen::Vector4d::Unit(1),
                                                       Eigen::Vector4d::Unit(2), Eigen::Vector4d::Unit(3)};
  return turns;
}

std::optional<Eigen::Matrix3d> rotation_by_half_tangent(std::span<const AxisPair> axes) {
  Eigen::Matrix4d best_triangle;
  double best_weakest = -1;
  Eigen::Matrix3d best_turn;
  for (const Eigen::Vector4d& quaternion : half_turns()) {
    const Eigen::Matrix3d turn = rotation_of(quaternion);
    RowStack<4> rows;
    for (const AxisPair& pair : axes) {
      const Eigen::Vector3d b = turn * pair.b;
      Eigen::Matrix<double, 3, 4> row;
      row << cross_matrix(pair.a + b), b - pair.a;
      rows.add(row);
    }
    const Eigen::Matrix4d& triangle = rows.triangle();
    const double weakest = Eigen::JacobiSVD<Eigen::Matrix3d>(triangle.topLeftCorner<3, 3>()).singularValues()(2);
    if (weakest > best_weakest) {
      best_triangle = triangle;
      best_weakest = weakest;
      best_turn = turn;
    }
  }
  const auto z = solve_triangle(best_triangle);
  if (!z) return std::nullopt;
  return rotation_of({1, (*z)(0), (*z)(1), (*z)(2)}) * best_turn;
}

AxisFamily axis_family(const Eigen::Vector3d& axis_a, const Eigen::Vector3d& axis_b) {
  const Eigen::Vector3d x_a = axis_a.unitOrthogonal(), x_b = axis_b.unitOrthogonal();
  const Eigen::Vector3d y_a = axis_a.cross(x_a), y_b = axis_b.cross(x_b);
  return {axis_a * axis_b.transpose(), x_a * x_b.transpose() + y_a * y_b.transpose(),
          y_a * x_b.transpose() - x_a * y_b.transpose()};
}

Pose make_pose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  pose.translation() = translation;
  return pose;
}

Matrix3x4d raw_matrix(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
  Matrix3x4d m;
  m << rotation, translation;
  return m;
}

std::unexpected<Error> no_one_solution(std::string_view of_what) {
  return failure(Fault::kDegenerateMotion,
                 "the equations of {} have no one solution: motions too alike, or poses that "
                 "contradict each other",
                 of_what);
}

Result<HandEyeSolution> solution_of_rotation(const Problem& problem, const Eigen::Matrix3d& rotation) {
  RowStack<4> rows;
  for (const Motion& m : problem.motions) {
    Eigen::Matrix<double, 3, 4> row;
    row << m.a.linear() - Eigen::Matrix3d::Identity(), rotation * m.b.translation() - m.a.translation();
    rows.add(row);
  }
  const auto t = solve_triangle(rows.triangle());
  if (!t) return no_one_solution("the translation");
  return HandEyeSolution{Transform<Flange, Camera>(make_pose(rotation, *t)), {}, {}, {}};
}

Result<HandEyeSolution> solution_of_rotations(const Problem& problem, const Eigen::Matrix3d& rotation_p,
                                              const Eigen::Matrix3d& rotation_q) {
  RowStack<7> rows;
  for (const View& view : problem.views) {
    Eigen::Matrix<double, 3, 7> row;
    row << view.a.linear(), -Eigen::Matrix3d::Identity(), rotation_q * view.b.translation() - view.a.translation();
    rows.add(row);
  }
  const auto t = solve_triangle(rows.triangle());
  if (!t) return no_one_solution("the translations");
  return HandEyeSolution{Transform<Flange, Camera>(make_pose(rotation_q, t->tail<3>())),
                         Transform<Base, Board>(make_pose(rotation_p, t->head<3>())),
                         {},
                         {}};
}

}  // namespace firstlook::solvers
