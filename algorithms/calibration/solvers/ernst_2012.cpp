#include <cmath>

#include "algorithms/calibration/solvers/algebra.hpp"
#include "algorithms/calibration/solvers/solvers.hpp"

namespace firstlook::solvers {
namespace {

/// RMS length of the robot's and the camera's translations, m.
double rms_length(const Problem& problem) {
  double squared = 0;
  for (const PosePair& pair : problem.pairs) {
    squared += pair.base_T_flange.translation().squaredNorm() + pair.camera_T_board.translation().squaredNorm();
  }
  return std::sqrt(squared / (2 * static_cast<double>(problem.pairs.size())));
}

/// M X N^-1 = Y with M = base_T_flange, X = flange_T_camera, N^-1 = camera_T_board, Y = base_T_board; `weight`: of an
/// equation of translation (1/m).
Result<HandEyeSolution> solve_24(const Problem& problem, double weight) {
  if (auto status = check_not_about_one_point(problem); !status) return std::unexpected(status.error());
  // Columns: vec R_X, t_X, t_Y, vec R_Y, right side. The heavy rows first: QR loses digits where they follow light
  // ones.
  RowStack<25> rows;
  for (const PosePair& pair : problem.pairs) {
    const Eigen::Matrix3d m = pair.base_T_flange.rotation();
    Eigen::Matrix<double, 3, 25> row;
    row << kronecker(pair.camera_T_board.translation(), m), m, -Eigen::Matrix3d::Identity(), Matrix3x9d::Zero(),
        -pair.base_T_flange.translation();
    rows.add(weight * row);
  }
  for (const PosePair& pair : problem.pairs) {
    Eigen::Matrix<double, 9, 25> row = Eigen::Matrix<double, 9, 25>::Zero();
    row.leftCols<9>() =
        kronecker(Eigen::Matrix3d(pair.camera_T_board.rotation().transpose()), pair.base_T_flange.rotation());
    row.block<9, 9>(0, 15) = -Matrix9d::Identity();
    rows.add(row);
  }
  const auto x = solve_triangle(rows.triangle());
  if (!x) return no_one_solution("both transforms");
  const Eigen::Matrix3d raw_x = unvec(x->head<9>()), raw_y = unvec(x->tail<9>());
  if (auto status = check_near_rotation(raw_x); !status) return std::unexpected(status.error());
  if (auto status = check_near_rotation(raw_y); !status) return std::unexpected(status.error());
  auto solution = solution_of_rotations(problem, nearest_rotation(raw_y), nearest_rotation(raw_x));
  if (!solution) return solution;
  solution->raw_flange_T_camera = raw_matrix(raw_x, x->segment<3>(9));
  solution->raw_base_T_board = raw_matrix(raw_y, x->segment<3>(12));
  return solution;
}

/// Chordal mean of the board's rotation in base over the views that saw it; empty when none did.
std::optional<Eigen::Matrix3d> board_rotation(const Problem& problem, const Eigen::Matrix3d& flange_R_camera) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  bool seen = false;
  for (const PosePair& pair : problem.pairs) {
    if (!pair.camera_T_board.rotation().allFinite()) continue;
    sum += pair.base_T_flange.rotation() * flange_R_camera * pair.camera_T_board.rotation();
    seen = true;
  }
  if (!seen) return std::nullopt;
  return nearest_rotation(sum);
}

}  // namespace

Result<HandEyeSolution> qr24(const Problem& problem) { return solve_24(problem, 1000); }

Result<HandEyeSolution> qr24_preconditioned(const Problem& problem) {
  return solve_24(problem, 1 / rms_length(problem));
}

Result<HandEyeSolution> qr15(const Problem& problem) {
  if (auto status = check_not_about_one_point(problem); !status) return std::unexpected(status.error());
  RowStack<16> rows;
  for (const PosePair& pair : problem.pairs) {
    const Eigen::Matrix3d m = pair.base_T_flange.rotation();
    Eigen::Matrix<double, 3, 16> row;
    row << kronecker(pair.camera_T_board.translation(), m), m, -Eigen::Matrix3d::Identity(),
        -pair.base_T_flange.translation();
    rows.add(row);
  }
  const auto x = solve_triangle(rows.triangle());
  if (!x) {
    return failure(Fault::kDegenerateMotion,
                   "{} positions of the board do not determine 15 numbers: see it near and far, left, right, up and "
                   "down in the image, from flange rotations about two axes",
                   problem.pairs.size());
  }
  const Eigen::Matrix3d raw = unvec(x->head<9>());
  if (auto status = check_near_rotation(raw); !status) return std::unexpected(status.error());
  const Eigen::Matrix3d rotation = nearest_rotation(raw);
  const auto board = board_rotation(problem, rotation);
  auto solution = solution_of_rotations(problem, board.value_or(Eigen::Matrix3d::Identity()), rotation);
  if (!solution) return solution;
  if (!board) solution->base_T_board.reset();
  solution->raw_flange_T_camera = raw_matrix(raw, x->segment<3>(9));
  return solution;
}

}  // namespace firstlook::solvers
