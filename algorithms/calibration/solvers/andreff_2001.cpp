#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {

Result<HandEyeSolution> andreff(const Problem& problem) {
  if (auto status = check_not_about_one_point(problem); !status) return std::unexpected(status.error());
  RowStack<13> rows;
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  for (const Motion& m : problem.motions) {
    Eigen::Matrix<double, 12, 13> row;
    row.setZero();
    row.topLeftCorner<9, 9>() =
        kronecker(identity, m.a.linear()) - kronecker(Eigen::Matrix3d(m.b.linear().transpose()), identity);
    row.bottomRows<3>() << kronecker(Eigen::Vector3d(m.b.translation()), identity), identity - m.a.linear(),
        m.a.translation();
    rows.add(row);
  }
  const auto x = solve_triangle(rows.triangle());
  if (!x) return no_one_solution("rotation and translation");
  const Eigen::Matrix3d raw = unvec(x->head<9>());
  if (auto status = check_near_rotation(raw); !status) return std::unexpected(status.error());
  auto solution = solution_of_rotation(problem, nearest_rotation(raw));
  if (!solution) return solution;
  solution->raw_flange_T_camera = raw_matrix(raw, x->tail<3>());
  return solution;
}

}  // namespace firstlook::solvers
