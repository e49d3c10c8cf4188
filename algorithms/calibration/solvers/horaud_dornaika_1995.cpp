#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/least_squares_over_poses.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {
namespace {

Eigen::Vector4d pure(const Eigen::Vector3d& v) { return {0, v.x(), v.y(), v.z()}; }

}  // namespace

Result<HandEyeSolution> horaud_dornaika(const Problem& problem) {
  // |alpha - q beta q*| = |alpha q - q beta| for a unit q.
  RowStack<4> rows;
  for (const Motion& m : problem.motions) {
    if (m.clear) rows.add(left_product(pure(m.alpha)) - right_product(pure(m.beta)));
  }
  return solution_of_rotation(problem, rotation_of(null_vector(rows.triangle())));
}

Result<HandEyeSolution> horaud_dornaika_nonlinear(const Problem& problem) {
  const auto start = horaud_dornaika(problem);
  if (!start) return start;
  RowStack<13> rows;
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  for (const Motion& m : problem.motions) {
    Eigen::Matrix<double, 3, 13> row;
    if (m.clear) {
      row << kronecker(m.beta, identity), Eigen::Matrix3d::Zero(), -m.alpha;
      rows.add(row);
    }
    row << -kronecker(Eigen::Vector3d(m.b.translation()), identity), m.a.linear() - identity, m.a.translation();
    rows.add(row);
  }
  const auto poses = least_squares_over_poses(rows.triangle(), {start->flange_T_camera.pose()});
  if (!poses) return std::unexpected(poses.error());
  return HandEyeSolution{Transform<Flange, Camera>(poses->front()), {}, {}, {}};
}

}  // namespace firstlook::solvers
