#include "algorithms/calibration/hand_eye_closed_form.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace firstlook {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// A second axis weaker than this is noise of the arm and the board's pose (about 1 mrad) as much as motion.
constexpr double kSecondAxisMin_rad = 1.0 * kDegree;
/// Beyond this the axis of a noisy rotation may come out with the other sign: such pairs are left out.
constexpr double kAngleMax_rad = 170 * kDegree;

/// Motions of flange (a) and camera (b) between two views, with their rotation vectors.
struct Motion {
  Pose a, b;
  Eigen::Vector3d alpha, beta;
};

Motion motion_between(const PosePair& from, const PosePair& to) {
  Motion m;
  m.a = from.base_T_flange.pose().inverse(Eigen::Isometry) * to.base_T_flange.pose();
  m.b = from.camera_T_board.pose() * to.camera_T_board.pose().inverse(Eigen::Isometry);
  m.alpha = rotation_log(m.a.linear());
  m.beta = rotation_log(m.b.linear());
  return m;
}

/// Between all views and in both directions, so that the order of the views means nothing.
std::vector<Motion> all_motions(std::span<const PosePair> pairs) {
  std::vector<Motion> motions;
  motions.reserve(pairs.size() * pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (std::size_t j = 0; j < pairs.size(); ++j) {
      if (i != j) motions.push_back(motion_between(pairs[i], pairs[j]));
    }
  }
  return motions;
}

bool is_clear(const Motion& m) { return m.alpha.norm() <= kAngleMax_rad && m.beta.norm() <= kAngleMax_rad; }

bool all_finite(const Pose& p) { return p.matrix().allFinite(); }

/// alpha = R beta in the least squares sense; equal to Park and Martin's (M^T M)^(-1/2) M^T where that is a rotation.
Eigen::Matrix3d park_martin_rotation(std::span<const Motion> motions) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  for (const Motion& motion : motions) {
    if (is_clear(motion)) m += motion.alpha * motion.beta.transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

/// Tsai and Lenz's vector 2 sin(angle / 2) axis.
Eigen::Vector3d half_sine_vector(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  return angle < 1e-12 ? rotation_vector : Eigen::Vector3d(rotation_vector * (2 * std::sin(angle / 2) / angle));
}

/// Tsai and Lenz, eq. 12, as normal equations for P' = tan(angle / 2) axis of the rotation that takes camera motions to
/// flange motions.
struct TsaiLenzEquations {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
};

/// The camera's axes are first turned by `turn`.
TsaiLenzEquations tsai_lenz_equations(std::span<const Motion> motions, const Eigen::Matrix3d& turn) {
  TsaiLenzEquations equations;
  for (const Motion& motion : motions) {
    if (!is_clear(motion)) continue;
    const Eigen::Vector3d a = half_sine_vector(motion.alpha);
    const Eigen::Vector3d b = half_sine_vector(turn * motion.beta);
    const Eigen::Matrix3d skew = cross_matrix(a + b);
    equations.normal += skew.transpose() * skew;
    equations.right += skew.transpose() * (b - a);
  }
  return equations;
}

/// P' grows without bound and its equations become singular when the hand-eye rotation nears 180 degrees. Of four equal
/// problems with the camera's axes turned by 0 and by 180 degrees about x, y and z, at least one has at most 120
/// degrees: the best conditioned is solved.
Eigen::Matrix3d tsai_lenz_rotation(std::span<const Motion> motions) {
  const std::array<Eigen::Vector3d, 4> turns = {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, -1, -1),
                                                Eigen::Vector3d(-1, 1, -1), Eigen::Vector3d(-1, -1, 1)};
  TsaiLenzEquations best;
  double best_eigenvalue = -1;
  Eigen::Matrix3d best_turn = Eigen::Matrix3d::Identity();
  for (const Eigen::Vector3d& diagonal : turns) {
    const Eigen::Matrix3d turn = diagonal.asDiagonal();
    const TsaiLenzEquations equations = tsai_lenz_equations(motions, turn);
    const double smallest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(equations.normal).eigenvalues()(0);
    if (smallest > best_eigenvalue) {
      best = equations;
      best_eigenvalue = smallest;
      best_turn = turn;
    }
  }
  const Eigen::Vector3d p = best.normal.ldlt().solve(best.right);
  const double tangent = p.norm();
  const Eigen::Vector3d rotation_vector = p * (tangent < 1e-12 ? 2.0 : 2 * std::atan(tangent) / tangent);
  return rotation_exp(rotation_vector) * best_turn;
}

/// (R_A - I) t = R t_B - t_A over all motions (Tsai and Lenz, eq. 15).
Eigen::Vector3d translation(std::span<const Motion> motions, const Eigen::Matrix3d& rotation) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Motion& m : motions) {
    const Eigen::Matrix3d lever = m.a.linear() - Eigen::Matrix3d::Identity();
    normal += lever.transpose() * lever;
    right += lever.transpose() * (rotation * m.b.translation() - m.a.translation());
  }
  return normal.ldlt().solve(right);
}

AxXbResidual residual_of(std::span<const Motion> motions, const Transform<Flange, Camera>& flange_T_camera) {
  if (motions.empty()) return {};
  const Pose& x = flange_T_camera.pose();
  double rotation2 = 0, translation2 = 0;
  for (const Motion& m : motions) {
    const Pose ax = m.a * x, xb = x * m.b;
    rotation2 += rotation_log(ax.linear().transpose() * xb.linear()).squaredNorm();
    translation2 += (ax.translation() - xb.translation()).squaredNorm();
  }
  const auto n = static_cast<double>(motions.size());
  return {std::sqrt(rotation2 / n) / kDegree, std::sqrt(translation2 / n) * 1e3};
}

}  // namespace

std::optional<Solver> find_solver(std::string_view name) {
  for (const Solver solver : {Solver::kParkMartin, Solver::kTsaiLenz}) {
    if (name == solver_name(solver)) return solver;
  }
  return std::nullopt;
}

std::string_view solver_name(Solver solver) { return solver == Solver::kParkMartin ? "park-martin" : "tsai-lenz"; }

MotionDiversity motion_diversity(std::span<const PosePair> pairs) {
  MotionDiversity diversity;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  const std::vector<Motion> motions = all_motions(pairs);
  for (const Motion& m : motions) {
    diversity.angle_max_rad = std::max(diversity.angle_max_rad, m.alpha.norm());
    scatter += m.alpha * m.alpha.transpose() / static_cast<double>(motions.size());
  }
  const Eigen::Vector3d spread = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues();
  diversity.second_axis_rad = std::sqrt(std::max(0.0, spread(1)));
  const double first_axis_rad = std::sqrt(std::max(0.0, spread(2)));
  diversity.axes = diversity.second_axis_rad >= kSecondAxisMin_rad ? 2 : first_axis_rad >= kSecondAxisMin_rad ? 1 : 0;
  return diversity;
}

Result<Transform<Flange, Camera>> solve_closed_form(std::span<const PosePair> pairs, Solver solver) {
  for (const PosePair& pair : pairs) {
    if (!all_finite(pair.base_T_flange.pose()) || !all_finite(pair.camera_T_board.pose())) {
      return failure(Fault::kSolveFailed, "a pose is not finite");
    }
  }
  if (pairs.size() < 3) return failure(Fault::kTooFewViews, "{} views, 3 are the least", pairs.size());
  const MotionDiversity diversity = motion_diversity(pairs);
  if (diversity.axes < 2) {
    return failure(Fault::kDegenerateMotion,
                   "{} views turn about {} axis only: largest rotation {:.1f} deg, about a second axis {:.2f} deg RMS",
                   pairs.size(), diversity.axes == 0 ? "no" : "one", diversity.angle_max_rad / kDegree,
                   diversity.second_axis_rad / kDegree);
  }
  const std::vector<Motion> motions = all_motions(pairs);
  Pose result = Pose::Identity();
  result.linear() = solver == Solver::kTsaiLenz ? tsai_lenz_rotation(motions) : park_martin_rotation(motions);
  result.translation() = translation(motions, result.linear());
  if (!all_finite(result)) return failure(Fault::kSolveFailed, "the closed form has no finite solution");
  return Transform<Flange, Camera>(result);
}

Transform<Base, Board> mean_board_pose(std::span<const PosePair> pairs,
                                       const Transform<Flange, Camera>& flange_T_camera) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  for (const PosePair& pair : pairs) {
    const Pose board = (pair.base_T_flange * flange_T_camera * pair.camera_T_board).pose();
    sum += board.linear();
    position += board.translation() / static_cast<double>(pairs.size());
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d sign(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  Pose mean = Pose::Identity();
  mean.linear() = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  mean.translation() = position;
  return Transform<Base, Board>(mean);
}

AxXbResidual ax_xb_residual_all_pairs(std::span<const PosePair> pairs,
                                      const Transform<Flange, Camera>& flange_T_camera) {
  return residual_of(all_motions(pairs), flange_T_camera);
}

AxXbResidual ax_xb_residual_consecutive(std::span<const PosePair> pairs,
                                        const Transform<Flange, Camera>& flange_T_camera) {
  std::vector<Motion> motions;
  for (std::size_t i = 1; i < pairs.size(); ++i) motions.push_back(motion_between(pairs[i - 1], pairs[i]));
  return residual_of(motions, flange_T_camera);
}

AxXbResidual board_in_base_residual(std::span<const PosePair> pairs, const Transform<Flange, Camera>& flange_T_camera) {
  if (pairs.empty()) return {};
  const Transform<Base, Board> mean = mean_board_pose(pairs, flange_T_camera);
  double rotation2 = 0, translation2 = 0;
  for (const PosePair& pair : pairs) {
    const auto seen = pair.base_T_flange * flange_T_camera * pair.camera_T_board;
    const Vector6d difference = pose_difference(seen.pose(), mean.pose());
    translation2 += difference.head<3>().squaredNorm();
    rotation2 += difference.tail<3>().squaredNorm();
  }
  const auto n = static_cast<double>(pairs.size());
  return {std::sqrt(rotation2 / n) / kDegree, std::sqrt(translation2 / n) * 1e3};
}

}  // namespace firstlook
