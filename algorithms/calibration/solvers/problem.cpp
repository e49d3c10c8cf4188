#include "algorithms/calibration/solvers/problem.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <numbers>
#include <optional>

#include "algorithms/calibration/solvers/algebra.hpp"

namespace firstlook::solvers {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// A second axis weaker than this is noise of the arm and the board's pose (about 1 mrad) as much as motion.
constexpr double kSecondAxisMin_rad = 1.0 * kDegree;
/// Beyond the first the axis of a rotation with some degrees of noise may come out with the other sign: such motions
/// are left out. When too few are left (three views), those up to the second, which a milliradian of noise does not
/// turn.
constexpr std::array kClearMax_rad = {170 * kDegree, 179 * kDegree};
/// Printed digits and single precision stay far below it; a matrix that is no rotation does not.
constexpr double kRigidMax = 1e-4;
/// No arm reaches that far: such a number is not metres.
constexpr double kDistanceMax_m = 1e4;
/// Above what a good arm and a good board scatter, far below what tells the scale to a percent.
constexpr double kOnePointMin_m = 2e-3;

bool is_rigid(const Eigen::Matrix3d& r) {
  return (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kRigidMax && r.determinant() > 0;
}

bool before(const PosePair& left, const PosePair& right) {
  for (const bool flange : {true, false}) {
    const Pose& l = flange ? left.base_T_flange.pose() : left.camera_T_board.pose();
    const Pose& r = flange ? right.base_T_flange.pose() : right.camera_T_board.pose();
    for (Eigen::Index column = 3; column >= 0; --column) {
      for (Eigen::Index row = 0; row < 3; ++row) {
        const auto order = std::strong_order(l(row, column), r(row, column));
        if (order != std::strong_ordering::equal) return order == std::strong_ordering::less;
      }
    }
  }
  return left.target < right.target;
}

MotionDiversity diversity_of(std::span<const Eigen::Vector3d> rotation_vectors, double clear_max_rad) {
  MotionDiversity diversity;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  double clear = 0;
  for (const Eigen::Vector3d& v : rotation_vectors) {
    diversity.angle_max_rad = std::max(diversity.angle_max_rad, v.norm());
    if (v.norm() > clear_max_rad) continue;
    scatter += v * v.transpose();
    clear += 1;
  }
  if (clear == 0) return diversity;
  const Eigen::Vector3d spread = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter / clear).eigenvalues();
  diversity.second_axis_rad = std::sqrt(std::max(0.0, spread(1)));
  const double first_axis_rad = std::sqrt(std::max(0.0, spread(2)));
  diversity.axes = diversity.second_axis_rad >= kSecondAxisMin_rad ? 2 : first_axis_rad >= kSecondAxisMin_rad ? 1 : 0;
  return diversity;
}

Status check_diversity(std::string_view who, std::size_t views, const MotionDiversity& diversity) {
  if (diversity.axes == 2) return {};
  return failure(Fault::kDegenerateMotion,
                 "{} views turn the {} about {} only: largest rotation {:.1f} deg, about a second axis {:.2f} deg RMS "
                 "(half turns do not count)",
                 views, who, diversity.axes == 0 ? "no axis" : "one axis", diversity.angle_max_rad / kDegree,
                 diversity.second_axis_rad / kDegree);
}

Status check_poses(std::span<const PosePair> pairs, bool board_rotation) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Pose& flange = pairs[i].base_T_flange.pose();
    const Pose& board = pairs[i].camera_T_board.pose();
    const bool seen = board_rotation || board.linear().allFinite();
    if (!flange.matrix().allFinite() || !board.translation().allFinite() ||
        (board_rotation && !board.linear().allFinite())) {
      return failure(Fault::kSolveFailed, "view {}: a pose is not finite", i + 1);
    }
    if (flange.translation().norm() > kDistanceMax_m || board.translation().norm() > kDistanceMax_m) {
      return failure(Fault::kSolveFailed, "view {}: a translation of more than {:.0f} m", i + 1, kDistanceMax_m);
    }
    if (!is_rigid(flange.linear()) || (seen && !is_rigid(board.linear()))) {
      return failure(Fault::kSolveFailed, "view {}: the rotation of a pose is not orthonormal", i + 1);
    }
  }
  return {};
}

Motion motion_between(const PosePair& from, const PosePair& to) {
  Motion m = {};
  m.a = from.base_T_flange.pose().inverse(Eigen::Isometry) * to.base_T_flange.pose();
  m.b = from.camera_T_board.pose() * to.camera_T_board.pose().inverse(Eigen::Isometry);
  m.alpha = rotation_log(m.a.linear());
  m.beta = rotation_log(m.b.linear());
  return m;
}

Eigen::Vector4d wxyz(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

/// A quaternion's sign is free, but A P = Q B needs signs that match. A rough hand-eye rotation (Park and Martin, from
/// the clear motions) says what each view thinks of the board's quaternion: all must think the same.
void set_quaternions(Problem& problem) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Motion& m : problem.motions) {
    if (m.clear) scatter += m.alpha * m.beta.transpose();
  }
  const Eigen::Quaterniond q(nearest_rotation(scatter));
  std::vector<std::optional<Eigen::Quaterniond>> first(static_cast<std::size_t>(target_count(problem.pairs)));
  std::vector<Eigen::Quaterniond> a, b;
  for (std::size_t i = 0; i < problem.views.size(); ++i) {
    a.emplace_back(problem.views[i].a.linear());
    b.emplace_back(problem.views[i].b.linear());
    const Eigen::Quaterniond p = a.back().conjugate() * q * b.back();
    auto& board = first[static_cast<std::size_t>(problem.pairs[i].target)];
    if (!board) board = p;
    if (p.dot(*board) < 0) b.back().coeffs() = -b.back().coeffs();
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    problem.views[i].qa = wxyz(a[i]);
    problem.views[i].qb = wxyz(b[i]);
  }
  auto motion = problem.motions.begin();
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < a.size(); ++j) {
      if (i == j || problem.pairs[i].target != problem.pairs[j].target) continue;
      motion->qa = wxyz(a[i] * a[j].conjugate());
      motion->qb = wxyz(b[i] * b[j].conjugate());
      ++motion;
    }
  }
}

Status add_motions(Problem& problem) {
  const std::size_t n = problem.pairs.size();
  problem.motions.reserve(n * (n - 1));
  std::vector<Eigen::Vector3d> alpha, beta;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      if (i == j || problem.pairs[i].target != problem.pairs[j].target) continue;
      problem.motions.push_back(motion_between(problem.pairs[i], problem.pairs[j]));
      alpha.push_back(problem.motions.back().alpha);
      beta.push_back(problem.motions.back().beta);
    }
  }
  double clear_max_rad = 0;
  for (const double limit : kClearMax_rad) {
    clear_max_rad = limit;
    if (diversity_of(alpha, limit).axes == 2 && diversity_of(beta, limit).axes == 2) break;
  }
  for (Motion& m : problem.motions) m.clear = std::max(m.alpha.norm(), m.beta.norm()) <= clear_max_rad;
  if (auto status = check_diversity("flange", n, diversity_of(alpha, clear_max_rad)); !status) return status;
  return check_diversity("board as seen", n, diversity_of(beta, clear_max_rad));
}

}  // namespace

}  // namespace firstlook::solvers

namespace firstlook {

MotionDiversity motion_diversity(std::span<const PosePair> pairs) {
  std::vector<Eigen::Vector3d> alpha;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (std::size_t j = i + 1; j < pairs.size(); ++j) {
      if (pairs[i].target != pairs[j].target) continue;
      alpha.push_back(rotation_log(pairs[i].base_T_flange.rotation().transpose() * pairs[j].base_T_flange.rotation()));
    }
  }
  MotionDiversity diversity;
  for (const double limit : solvers::kClearMax_rad) {
    diversity = solvers::diversity_of(alpha, limit);
    if (diversity.axes == 2) break;
  }
  return diversity;
}

}  // namespace firstlook

namespace firstlook::solvers {

Result<Problem> prepare(std::span<const PosePair> pairs, const Requirements& requirements) {
  if (auto status = check_poses(pairs, requirements.board_rotation); !status) return std::unexpected(status.error());
  if (pairs.size() < static_cast<std::size_t>(requirements.poses_min)) {
    return failure(Fault::kTooFewViews, "{} views, {} are the least", pairs.size(), requirements.poses_min);
  }
  Problem problem;
  problem.pairs.assign(pairs.begin(), pairs.end());
  std::sort(problem.pairs.begin(), problem.pairs.end(), before);
  for (const PosePair& pair : problem.pairs) {
    problem.views.push_back({pair.base_T_flange.pose().inverse(Eigen::Isometry), pair.camera_T_board.pose()});
  }
  if (!requirements.board_rotation) {
    if (auto status = check_diversity("flange", pairs.size(), motion_diversity(pairs)); !status) {
      return std::unexpected(status.error());
    }
    return problem;
  }
  if (auto status = add_motions(problem); !status) return std::unexpected(status.error());
  set_quaternions(problem);
  return problem;
}

Status check_not_about_one_point(const Problem& problem) {
  // base_T_flange p = c for all views: R p - c = -t.
  RowStack<7> rows;
  for (const PosePair& pair : problem.pairs) {
    Eigen::Matrix<double, 3, 7> row;
    row << pair.base_T_flange.rotation(), -Eigen::Matrix3d::Identity(), -pair.base_T_flange.translation();
    rows.add(row);
  }
  const double rms_m = std::abs(rows.triangle()(6, 6)) / std::sqrt(static_cast<double>(problem.pairs.size()));
  if (rms_m >= kOnePointMin_m) return {};
  return failure(Fault::kDegenerateMotion,
                 "the flange turns about one point that stands still within {:.2f} mm: rotation and translation cannot "
                 "be solved together; move the wrist too, or take another solver (park-martin, shah)",
                 rms_m * 1e3);
}

Status check_near_rotation(const Eigen::Matrix3d& raw) {
  const Eigen::Vector3d s = Eigen::JacobiSVD<Eigen::Matrix3d>(raw).singularValues();
  if (s(2) > 0.8 && s(0) < 1.25 && raw.determinant() > 0) return {};
  return failure(Fault::kDegenerateMotion,
                 "the linear solution is no rotation (singular values {:.3g}, {:.3g}, {:.3g}, 1 expected): views too "
                 "few or too alike for this solver; add views, or take park-martin",
                 s(0), s(1), s(2));
}

}  // namespace firstlook::solvers
