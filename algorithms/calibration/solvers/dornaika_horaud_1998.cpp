#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/least_squares_over_poses.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {

Result<HandEyeSolution> dornaika_horaud(const Problem& problem) {
  // The leading singular vectors u, v of sum of left_product(a)^T right_product(b) are the null vector (u, v) of these
  // rows, which keep twice the digits when motions are small.
  RowStack<8> rows;
  for (const View& view : problem.views) {
    Eigen::Matrix<double, 4, 8> row;
    row << left_product(view.qa), -right_product(view.qb);
    rows.add(row);
  }
  const Eigen::VectorXd both = null_vector(rows.triangle());
  return solution_of_rotations(problem, rotation_of(both.head<4>()), rotation_of(both.tail<4>()));
}

Result<HandEyeSolution> dornaika_horaud_nonlinear(const Problem& problem) {
  const auto start = dornaika_horaud(problem);
  if (!start) return start;
  RowStack<25> rows;
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  for (const View& view : problem.views) {
    Eigen::Matrix<double, 12, 25> row = Eigen::Matrix<double, 12, 25>::Zero();
    row.block<9, 9>(0, 0) = kronecker(identity, view.a.linear());
    row.block<9, 9>(0, 12) = -kronecker(Eigen::Matrix3d(view.b.linear().transpose()), identity);
    row.block<3, 3>(9, 9) = view.a.linear();
    row.block<3, 9>(9, 12) = -kronecker(Eigen::Vector3d(view.b.translation()), identity);
    row.block<3, 3>(9, 21) = -identity;
    row.block<3, 1>(9, 24) = view.a.translation();
    rows.add(row);
  }
  const auto poses =
      least_squares_over_poses(rows.triangle(), {start->base_T_board->pose(), start->flange_T_camera.pose()});
  if (!poses) return std::unexpected(poses.error());
  return HandEyeSolution{Transform<Flange, Camera>(poses->back()), Transform<Base, Board>(poses->front()), {}, {}};
}

}  // namespace firstlook::solvers
