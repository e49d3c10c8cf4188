#include <cmath>

#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/least_squares_over_poses.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {
namespace {

/// The axis of a screw motion (Chasles): direction, and its point nearest to the origin times 2 sin(angle / 2).
struct Screw {
  Eigen::Vector3d axis, scaled_point;
  double scale = 0;
};

Screw screw_of(const Pose& motion, const Eigen::Vector3d& rotation_vector) {
  const double half = rotation_vector.norm() / 2;
  const Eigen::Vector3d axis = rotation_vector.normalized();
  const Eigen::Vector3d across = motion.translation() - axis * axis.dot(motion.translation());
  return {axis, std::sin(half) * across + std::cos(half) * axis.cross(across), 2 * std::sin(half)};
}

Eigen::Matrix3d across_of(const Eigen::Vector3d& axis) { return Eigen::Matrix3d::Identity() - axis * axis.transpose(); }

/// X carries B's axis into A's: (I - k k^T) (t + R c_B - c_A) = 0, here times 2 sin(angle / 2) of A.
struct AxisPoints {
  Eigen::Matrix3d across;
  Eigen::Vector3d c_a, c_b;
  double scale = 0;
};

AxisPoints axis_points(const Screw& a, const Screw& b) {
  return {across_of(a.axis), a.scaled_point, b.scaled_point * (a.scale / b.scale), a.scale};
}

bool is_usable(const Motion& m) { return m.clear && m.alpha.norm() > 0 && m.beta.norm() > 0; }

Result<Eigen::Vector3d> translation_of_axes(const Problem& problem, const Eigen::Matrix3d& rotation) {
  RowStack<4> rows;
  for (const Motion& m : problem.motions) {
    if (!is_usable(m)) continue;
    const AxisPoints points = axis_points(screw_of(m.a, m.alpha), screw_of(m.b, m.beta));
    Eigen::Matrix<double, 3, 4> row;
    row << points.scale * points.across, points.across * (points.c_a - rotation * points.c_b);
    rows.add(row);
  }
  const auto t = solve_triangle(rows.triangle());
  if (!t) return no_one_solution("the translation");
  return Eigen::Vector3d(*t);
}

}  // namespace

Result<HandEyeSolution> li_betsis(const Problem& problem) {
  RowStack<13> rows;
  for (const Motion& m : problem.motions) {
    if (!is_usable(m)) continue;
    const Screw a = screw_of(m.a, m.alpha), b = screw_of(m.b, m.beta);
    const AxisFamily family = axis_family(a.axis, b.axis);
    const Vector9d across = vec(family.across), turned = vec(family.turned);
    Eigen::Matrix<double, 12, 13> row;
    row.setZero();
    row.topLeftCorner<9, 9>() = Matrix9d::Identity() - (across * across.transpose() + turned * turned.transpose()) / 2;
    row.block<9, 1>(0, 12) = vec(family.along);
    row.topRows<9>() *= a.scale;
    const AxisPoints points = axis_points(a, b);
    row.bottomRows<3>() << kronecker(points.c_b, points.across), points.scale * points.across,
        points.across * points.c_a;
    rows.add(row);
  }
  const auto x = solve_triangle(rows.triangle());
  if (!x) return no_one_solution("rotation and translation");
  const Eigen::Matrix3d raw = unvec(x->head<9>());
  if (auto status = check_near_rotation(raw); !status) return std::unexpected(status.error());
  const Eigen::Matrix3d rotation = nearest_rotation(raw);
  const auto t = translation_of_axes(problem, rotation);
  if (!t) return std::unexpected(t.error());
  return HandEyeSolution{Transform<Flange, Camera>(make_pose(rotation, *t)), {}, raw_matrix(raw, x->tail<3>()), {}};
}

Result<HandEyeSolution> li_betsis_nonlinear(const Problem& problem) {
  const auto start = chou_kamel(problem);
  if (!start) return start;
  RowStack<13> rows;
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  for (const Motion& m : problem.motions) {
    Eigen::Matrix<double, 12, 13> row;
    row.setZero();
    row.topLeftCorner<9, 9>() =
        kronecker(identity, m.a.linear()) - kronecker(Eigen::Matrix3d(m.b.linear().transpose()), identity);
    row.bottomRows<3>() << -kronecker(Eigen::Vector3d(m.b.translation()), identity), m.a.linear() - identity,
        m.a.translation();
    rows.add(row);
  }
  const auto poses = least_squares_over_poses(rows.triangle(), {start->flange_T_camera.pose()});
  if (!poses) return std::unexpected(poses.error());
  return HandEyeSolution{Transform<Flange, Camera>(poses->front()), {}, {}, {}};
}

}  // namespace firstlook::solvers
