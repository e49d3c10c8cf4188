#include "algorithms/calibration/solvers/least_squares_over_poses.hpp"

#include "algorithms/vision/rotation.hpp"

namespace firstlook::solvers {
namespace {

Eigen::VectorXd numbers_of(const std::vector<Pose>& poses) {
  Eigen::VectorXd p(12 * static_cast<Eigen::Index>(poses.size()) + 1);
  Eigen::Index at = 0;
  for (const Pose& pose : poses) {
    p.segment<9>(at) = vec(pose.linear());
    p.segment<3>(at + 9) = pose.translation();
    at += 12;
  }
  p(at) = 1;
  return p;
}

/// Derivative of the numbers by steps (dt, dr) of each pose: t + dt, Exp(dr) R.
Eigen::MatrixXd jacobian_of(const std::vector<Pose>& poses) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(12 * n + 1, 6 * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Matrix3d r = poses[static_cast<std::size_t>(k)].linear();
    for (Eigen::Index column = 0; column < 3; ++column) {
      j.block<3, 3>(12 * k + 3 * column, 6 * k + 3) = -cross_matrix(r.col(column));
    }
    j.block<3, 3>(12 * k + 9, 6 * k).setIdentity();
  }
  return j;
}

std::vector<Pose> stepped(const std::vector<Pose>& poses, const Eigen::VectorXd& step) {
  std::vector<Pose> next;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    next.push_back(perturb(poses[k], step.segment<6>(6 * static_cast<Eigen::Index>(k))));
  }
  return next;
}

/// The step that minimises |J step + residual|^2 + damping^2 |scale step|^2.
Eigen::VectorXd damped_step(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& residual, double damping) {
  const Eigen::Index n = jacobian.cols();
  Eigen::MatrixXd rows(jacobian.rows() + n, n);
  rows << jacobian, Eigen::MatrixXd((damping * jacobian.colwise().norm()).asDiagonal());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(rows.rows());
  right.head(residual.size()) = -residual;
  return rows.colPivHouseholderQr().solve(right);
}

}  // namespace

Result<std::vector<Pose>> least_squares_over_poses(const Eigen::MatrixXd& triangle, std::vector<Pose> start) {
  constexpr int kIterationsMax = 1000;  // views that contradict each other converge slowly
  constexpr double kStepMin = 1e-13;    // m and rad
  std::vector<Pose> poses = std::move(start);
  Eigen::VectorXd residual = triangle * numbers_of(poses);
  double damping = 0;
  for (int i = 0; i < kIterationsMax; ++i) {
    const Eigen::VectorXd step = damped_step(triangle * jacobian_of(poses), residual, damping);
    if (!step.allFinite()) break;
    const std::vector<Pose> next = stepped(poses, step);
    const Eigen::VectorXd next_residual = triangle * numbers_of(next);
    const bool better = next_residual.squaredNorm() < residual.squaredNorm();
    if (better) {
      poses = next;
      residual = next_residual;
      damping = damping < 1e-6 ? 0 : damping / 10;
    } else {
      damping = damping == 0 ? 1e-3 : damping * 10;
    }
    if (step.norm() < kStepMin) return poses;
  }
  return failure(Fault::kSolveFailed, "the nonlinear least squares over poses did not converge");
}

}  // namespace firstlook::solvers
