#include <Eigen/SVD>
#include <cmath>

#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"
#include "algorithms/vision/rotation.hpp"

namespace firstlook::solvers {
namespace {

/// Axis of the rotation for camera axes turned by `turn`; second: how sure, the second smallest singular value of the
/// differences.
std::pair<Eigen::Vector3d, double> axis_of_rotation(const Problem& problem, const Eigen::Matrix3d& turn) {
  RowStack<3> differences;
  for (const Motion& m : problem.motions) {
    if (m.clear) differences.add((m.alpha - turn * m.beta).transpose());
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(differences.triangle(), Eigen::ComputeFullV);
  return {svd.matrixV().col(2), svd.singularValues()(1)};
}

}  // namespace

Result<HandEyeSolution> wang(const Problem& problem) {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  double sure = -1;
  for (const Eigen::Vector4d& quaternion : half_turns()) {
    const auto [candidate, candidate_sure] = axis_of_rotation(problem, rotation_of(quaternion));
    if (candidate_sure > sure) {
      axis = candidate;
      sure = candidate_sure;
      turn = rotation_of(quaternion);
    }
  }
  double sine = 0, cosine = 0;
  for (const Motion& m : problem.motions) {
    if (!m.clear) continue;
    const Eigen::Vector3d b = turn * m.beta;
    sine += axis.dot(b.cross(m.alpha));
    cosine += b.dot(m.alpha) - axis.dot(b) * axis.dot(m.alpha);
  }
  return solution_of_rotation(problem, rotation_exp(axis * std::atan2(sine, cosine)) * turn);
}

}  // namespace firstlook::solvers
