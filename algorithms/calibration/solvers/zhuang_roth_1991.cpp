#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {

Result<HandEyeSolution> zhuang_roth(const Problem& problem) {
  std::vector<AxisPair> axes;
  for (const Motion& m : problem.motions) axes.push_back({m.qa.tail<3>(), m.qb.tail<3>()});
  const auto rotation = rotation_by_half_tangent(axes);
  if (!rotation) return no_one_solution("the rotation");
  return solution_of_rotation(problem, *rotation);
}

}  // namespace firstlook::solvers
