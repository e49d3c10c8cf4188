#include <cmath>

#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {
namespace {

Eigen::Vector3d modified_rodrigues(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  return angle < 1e-12 ? rotation_vector : Eigen::Vector3d(rotation_vector * (2 * std::sin(angle / 2) / angle));
}

}  // namespace

Result<HandEyeSolution> tsai_lenz(const Problem& problem) {
  std::vector<AxisPair> axes;
  for (const Motion& m : problem.motions) {
    if (m.clear) axes.push_back({modified_rodrigues(m.alpha), modified_rodrigues(m.beta)});
  }
  const auto rotation = rotation_by_half_tangent(axes);
  if (!rotation) return no_one_solution("the rotation");
  return solution_of_rotation(problem, *rotation);
}

}  // namespace firstlook::solvers
