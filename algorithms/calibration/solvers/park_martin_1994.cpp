#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {

Result<HandEyeSolution> park_martin(const Problem& problem) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  for (const Motion& motion : problem.motions) {
    if (motion.clear) m += motion.alpha * motion.beta.transpose();
  }
  return solution_of_rotation(problem, nearest_rotation(m));
}

}  // namespace firstlook::solvers
