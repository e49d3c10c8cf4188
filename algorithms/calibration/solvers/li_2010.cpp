#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {

Result<HandEyeSolution> li(const Problem& problem) {
  if (auto status = check_not_about_one_point(problem); !status) return std::unexpected(status.error());
  RowStack<25> rows;
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  for (const View& view : problem.views) {
    // Columns: vec R_P, t_P, vec R_Q, t_Q, right side.
    Eigen::Matrix<double, 12, 25> row = Eigen::Matrix<double, 12, 25>::Zero();
    row.block<9, 9>(0, 0) = kronecker(identity, view.a.linear());
    row.block<9, 9>(0, 12) = -kronecker(Eigen::Matrix3d(view.b.linear().transpose()), identity);
    row.block<3, 3>(9, 9) = view.a.linear();
    row.block<3, 9>(9, 12) = -kronecker(Eigen::Vector3d(view.b.translation()), identity);
    row.block<3, 3>(9, 21) = -identity;
    row.block<3, 1>(9, 24) = -view.a.translation();
    rows.add(row);
  }
  const auto x = solve_triangle(rows.triangle());
  if (!x) return no_one_solution("both transforms");
  const Eigen::Matrix3d raw_p = unvec(x->head<9>()), raw_q = unvec(x->segment<9>(12));
  if (auto status = check_near_rotation(raw_p); !status) return std::unexpected(status.error());
  if (auto status = check_near_rotation(raw_q); !status) return std::unexpected(status.error());
  HandEyeSolution solution;
  solution.base_T_board = Transform<Base, Board>(make_pose(nearest_rotation(raw_p), x->segment<3>(9)));
  solution.flange_T_camera = Transform<Flange, Camera>(make_pose(nearest_rotation(raw_q), x->tail<3>()));
  solution.raw_base_T_board = raw_matrix(raw_p, x->segment<3>(9));
  solution.raw_flange_T_camera = raw_matrix(raw_q, x->tail<3>());
  return solution;
}

}  // namespace firstlook::solvers
