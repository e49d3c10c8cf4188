#include "algorithms/calibration/hand_eye_closed_form.hpp"

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "algorithms/calibration/solvers/algebra.hpp"

namespace firstlook {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Motions of flange (a) and camera (b) between two views.
struct Motion {
  Pose a, b;
};

Motion motion_between(const PosePair& from, const PosePair& to) {
  return {from.base_T_flange.pose().inverse(Eigen::Isometry) * to.base_T_flange.pose(),
          from.camera_T_board.pose() * to.camera_T_board.pose().inverse(Eigen::Isometry)};
}

/// Between all views and in both directions, so that the order of the views means nothing.
std::vector<Motion> all_motions(std::span<const PosePair> pairs) {
  std::vector<Motion> motions;
  motions.reserve(pairs.size() * pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (std::size_t j = 0; j < pairs.size(); ++j) {
      if (i != j && pairs[i].target == pairs[j].target) motions.push_back(motion_between(pairs[i], pairs[j]));
    }
  }
  return motions;
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

/// AX = YB has one board: the views of the others are moved to the lowest numbered one, by where a first solution of
/// AX = XB (Park and Martin) puts them.
Result<std::vector<PosePair>> on_one_board(std::span<const PosePair> pairs) {
  const auto rough = solve_closed_form(pairs, Solver::kParkMartin);
  if (!rough) return std::unexpected(rough.error());
  std::vector<PosePair> moved;
  std::optional<Transform<Base, Board>> base_T_first;
  for (int k = 0; k < target_count(pairs); ++k) {
    const std::vector<PosePair> own = pairs_of_target(pairs, k);
    if (own.empty()) continue;
    const auto base_T_own = mean_board_pose(own, *rough);
    if (!base_T_first) base_T_first = base_T_own;
    const auto own_T_first = base_T_own.inverse() * *base_T_first;
    for (const PosePair& pair : own) moved.push_back({pair.base_T_flange, pair.camera_T_board * own_T_first});
  }
  return moved;
}

}  // namespace

Result<HandEyeSolution> solve_pose_pairs(std::span<const PosePair> pairs, Solver solver) {
  const SolverRow& row = solver_row(solver);
  if (row.equation == SolverEquation::kAxYb && target_count(pairs) > 1) {
    const auto moved = on_one_board(pairs);
    return moved ? solve_pose_pairs(*moved, solver) : std::unexpected(moved.error());
  }
  const auto problem = solvers::prepare(pairs, {row.poses_min, row.board_rotation});
  if (!problem) return std::unexpected(problem.error());
  auto solution = row.solve(*problem);
  if (solution && !solution->flange_T_camera.pose().matrix().allFinite()) {
    return failure(Fault::kSolveFailed, "{} has no finite solution", row.name);
  }
  return solution;
}

Result<Transform<Flange, Camera>> solve_closed_form(std::span<const PosePair> pairs, Solver solver) {
  const auto solution = solve_pose_pairs(pairs, solver);
  if (!solution) return std::unexpected(solution.error());
  return solution->flange_T_camera;
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
  Pose mean = Pose::Identity();
  mean.linear() = solvers::nearest_rotation(sum);
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
  for (int k = 0; k < target_count(pairs); ++k) {
    const std::vector<PosePair> own = pairs_of_target(pairs, k);
    for (std::size_t i = 1; i < own.size(); ++i) motions.push_back(motion_between(own[i - 1], own[i]));
  }
  return residual_of(motions, flange_T_camera);
}

AxXbResidual board_in_base_residual(std::span<const PosePair> pairs, const Transform<Flange, Camera>& flange_T_camera) {
  if (pairs.empty()) return {};
  std::vector<Transform<Base, Board>> means;
  for (int k = 0; k < target_count(pairs); ++k) {
    means.push_back(mean_board_pose(pairs_of_target(pairs, k), flange_T_camera));
  }
  double rotation2 = 0, translation2 = 0;
  for (const PosePair& pair : pairs) {
    const auto seen = pair.base_T_flange * flange_T_camera * pair.camera_T_board;
    const Vector6d difference = pose_difference(seen.pose(), means[static_cast<std::size_t>(pair.target)].pose());
    translation2 += difference.head<3>().squaredNorm();
    rotation2 += difference.tail<3>().squaredNorm();
  }
  const auto n = static_cast<double>(pairs.size());
  return {std::sqrt(rotation2 / n) / kDegree, std::sqrt(translation2 / n) * 1e3};
}

}  // namespace firstlook
