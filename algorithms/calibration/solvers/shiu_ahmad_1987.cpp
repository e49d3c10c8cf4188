#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {

Result<HandEyeSolution> shiu_ahmad(const Problem& problem) {
  RowStack<10> rows;
  for (const Motion& m : problem.motions) {
    const double angle = m.alpha.norm();
    if (!m.clear || angle == 0 || m.beta.norm() == 0) continue;
    const AxisFamily family = axis_family(m.alpha.normalized(), m.beta.normalized());
    const Vector9d across = vec(family.across), turned = vec(family.turned);
    // The best cosine and sine for a given R are R's parts along the two matrices, each of squared norm 2.
    Eigen::Matrix<double, 9, 10> row;
    row << Matrix9d::Identity() - (across * across.transpose() + turned * turned.transpose()) / 2, vec(family.along);
    rows.add(angle * row);
  }
  const auto r = solve_triangle(rows.triangle());
  if (!r) return no_one_solution("the rotation");
  return solution_of_rotation(problem, nearest_rotation(unvec(*r)));
}

}  // namespace firstlook::solvers
