#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {

Result<HandEyeSolution> chou_kamel(const Problem& problem) {
  RowStack<4> rows;
  for (const Motion& m : problem.motions) rows.add(left_product(m.qa) - right_product(m.qb));
  return solution_of_rotation(problem, rotation_of(null_vector(rows.triangle())));
}

}  // namespace firstlook::solvers
