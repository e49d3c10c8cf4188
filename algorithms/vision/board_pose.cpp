#include "algorithms/vision/board_pose.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <vector>

#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/homography.hpp"
#include "algorithms/vision/rotation.hpp"

namespace firstlook {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

struct Normal {
  Matrix6 jtj = Matrix6::Zero();
  Vector6 jtr = Vector6::Zero();
  double cost = 0;  ///< weighted sum of squared residuals, px^2
};

struct Problem {
  const CameraIntrinsics& camera;
  const BoardSpec& board;
  SeenPoints points;
  std::span<const double> weights;  ///< one for each point
  [[nodiscard]] Eigen::Vector3d on_board(std::size_t i) const { return board.corner(points.point(i)); }
};

/// Normal equations at a pose; empty when a corner has no image from there.
std::optional<Normal> linearize(const Problem& problem, const Pose& pose) {
  Normal n;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const Eigen::Vector3d turned = pose.linear() * problem.on_board(i);
    const auto projected = project_with_jacobian(problem.camera, turned + pose.translation());
    if (!projected) return std::nullopt;
    const Eigen::Vector2d residual = problem.points.corners_px[i] - projected->pixel;
    Eigen::Matrix<double, 2, 6> j;
    j << projected->d_pixel_d_point, -projected->d_pixel_d_point * cross_matrix(turned);
    const double weight = problem.weights[i];
    n.jtj += weight * j.transpose() * j;
    n.jtr += weight * j.transpose() * residual;
    n.cost += weight * residual.squaredNorm();
  }
  return n;
}

struct Refined {
  Pose pose;
  Normal normal;
};

std::optional<Refined> refine(const Problem& problem, Pose pose) {
  constexpr int kIterationsMax = 40;
  auto normal = linearize(problem, pose);
  if (!normal) return std::nullopt;
  double damping = 1e-4;
  for (int i = 0; i < kIterationsMax && damping < 1e9; ++i) {
    Matrix6 damped = normal->jtj;
    damped.diagonal() *= 1 + damping;
    const Vector6 step = damped.ldlt().solve(normal->jtr);
    if (!step.allFinite()) return std::nullopt;
    Pose next = pose;
    next.translation() += step.head<3>();
    next.linear() = rotation_exp(step.tail<3>()) * pose.linear();
    const auto there = linearize(problem, next);
    if (!there || there->cost > normal->cost) {
      damping *= 10;
      continue;
    }
    const bool settled = normal->cost - there->cost <= 1e-14 * normal->cost;
    pose = next;
    normal = there;
    damping /= 10;
    if (settled) break;
  }
  return Refined{pose, *normal};
}

/// Pose of the plane z = 0 from its homography to the normalised image (Zhang 2000, section 3.1).
std::optional<Pose> pose_from_homography(const Eigen::Matrix3d& h) {
  const double scale = 2 / (h.col(0).norm() + h.col(1).norm());
  if (!std::isfinite(scale)) return std::nullopt;
  const double sign = h(2, 2) < 0 ? -1 : 1;  // the board's origin lies in front of the camera
  Eigen::Matrix3d columns;
  columns.col(0) = sign * scale * h.col(0);
  columns.col(1) = sign * scale * h.col(1);
  columns.col(2) = columns.col(0).cross(columns.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(columns, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Pose pose = Pose::Identity();
  pose.linear() = svd.matrixU() * svd.matrixV().transpose();
  if (pose.linear().determinant() < 0) return std::nullopt;
  pose.translation() = sign * scale * h.col(2);
  return pose;
}

std::optional<Pose> start_pose(const Problem& problem) {
  std::vector<Eigen::Vector2d> plane, normalized;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const auto point = undistort(problem.camera, problem.points.corners_px[i]);
    if (!point) return std::nullopt;
    plane.push_back(problem.on_board(i).head<2>());
    normalized.push_back(*point);
  }
  const auto h = fit_homography(plane, normalized);
  return h ? pose_from_homography(*h) : std::nullopt;
}

/// The middle of the points that are seen.
Eigen::Vector3d middle_of(const Problem& problem) {
  if (problem.points.ids.empty()) return problem.board.center();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < problem.points.size(); ++i) sum += problem.on_board(i);
  return sum / static_cast<double>(problem.points.size());
}

/// False when both refinements ended in the same pose.
bool is_another(const Refined& a, const Refined& b) {
  constexpr double kApart_rad = 1e-3;
  return rotation_log(a.pose.linear() * b.pose.linear().transpose()).norm() > kApart_rad;
}

/// `coordinates` that the cost is summed over.
BoardPose to_board_pose(const Refined& refined, double coordinates) {
  BoardPose result;
  result.residual_rms_px = std::sqrt(refined.normal.cost / coordinates);
  // Through a quaternion, so that rounding leaves no trace of scale or shear.
  result.camera_T_board =
      Transform<Camera, Board>(Eigen::Quaterniond(refined.pose.linear()), refined.pose.translation());
  result.unit_covariance = refined.normal.jtj.inverse();
  return result;
}

std::vector<double> corner_residuals(const CameraIntrinsics& camera, const BoardSpec& board, const SeenPoints& points,
                                     const Transform<Camera, Board>& camera_T_board) {
  constexpr double kNoImage_px = 1e9;
  std::vector<double> lengths;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = project(camera, camera_T_board * board.corner(points.point(i)));
    lengths.push_back(pixel ? (points.corners_px[i] - *pixel).norm() : kNoImage_px);
  }
  return lengths;
}

/// Sigma of a coordinate from the median length: 1.1774 sigmas for a Rayleigh distribution.
std::vector<double> huber_weights(const std::vector<double>& lengths_px, double loss_scale, double sigma_min_px) {
  constexpr double kGate = 10;  // sigmas beyond which a corner is none
  std::vector<double> sorted = lengths_px;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double sigma_px = std::max(sigma_min_px, *middle / 1.1774);
  std::vector<double> weights;
  for (const double length : lengths_px) {
    const double sigmas = length / sigma_px;
    weights.push_back(sigmas <= loss_scale ? 1.0 : sigmas <= kGate ? loss_scale / sigmas : 0.0);
  }
  return weights;
}

}  // namespace

Pose mirrored_pose(const Pose& pose, const Eigen::Vector3d& center_in_board) {
  const Eigen::Vector3d center = pose * center_in_board;
  const Eigen::Vector3d sight = center.normalized();
  const Eigen::Vector3d normal = pose.linear().col(2);
  const Eigen::Vector3d other = 2 * normal.dot(sight) * sight - normal;
  Pose result = Pose::Identity();
  result.linear() = Eigen::Quaterniond::FromTwoVectors(normal, other).toRotationMatrix() * pose.linear();
  result.translation() = center - result.linear() * center_in_board;
  return result;
}

Result<BoardPose> estimate_board_pose(const CameraIntrinsics& camera, const BoardSpec& board, const SeenPoints& points,
                                      double residual_max_px) {
  if (const Status fine = check_board(board); !fine) return std::unexpected(fine.error());
  if (!is_usable(camera)) return failure(Fault::kConfigBadValue, "camera intrinsics are not usable");
  if (const Status fine = check_points(board, points); !fine) {
    return failure(Fault::kBoardNotFound, "{}", fine.error().detail());
  }
  const std::vector<double> weights(points.size(), 1.0);
  const Problem problem{camera, board, points, weights};
  const auto start = start_pose(problem);
  if (!start) return failure(Fault::kBoardNotFound, "the corners are not a board's image");
  std::optional<Refined> best = refine(problem, *start);
  std::optional<Refined> other = refine(problem, mirrored_pose(best ? best->pose : *start, middle_of(problem)));
  if (other && (!best || other->normal.cost < best->normal.cost)) std::swap(best, other);
  if (!best) return failure(Fault::kBoardNotFound, "the corners are not a board's image");

  const double coordinates = 2.0 * static_cast<double>(points.size());
  BoardPose result = to_board_pose(*best, coordinates);
  if (other && is_another(*best, *other)) {
    const BoardPose second = to_board_pose(*other, coordinates);
    result.other = {second.camera_T_board, second.residual_rms_px, second.unit_covariance};
  }
  if (!(result.residual_rms_px <= residual_max_px)) {
    return failure(Fault::kBoardNotFound, "corners off by {:.2f} px RMS from any pose of the board",
                   result.residual_rms_px);
  }
  return result;
}

Result<RobustBoardPose> estimate_board_pose_robust(const CameraIntrinsics& camera, const BoardSpec& board,
                                                   const SeenPoints& points, double residual_max_px, double loss_scale,
                                                   double sigma_min_px) {
  constexpr int kRounds = 4;
  const auto plain = estimate_board_pose(camera, board, points, residual_max_px);
  if (!plain) return std::unexpected(plain.error());
  RobustBoardPose robust{*plain, corner_residuals(camera, board, points, plain->camera_T_board), {}};
  for (int round = 0; round < kRounds; ++round) {
    robust.weights = huber_weights(robust.residuals_px, loss_scale, sigma_min_px);
    const double total = std::accumulate(robust.weights.begin(), robust.weights.end(), 0.0);
    if (total == static_cast<double>(robust.weights.size())) break;
    const auto refined = refine({camera, board, points, robust.weights}, robust.pose.camera_T_board.pose());
    if (!refined) return failure(Fault::kBoardNotFound, "too many corners contradict each other");
    robust.pose = to_board_pose(*refined, 2 * total);
    robust.pose.other = plain->other;
    robust.residuals_px = corner_residuals(camera, board, points, robust.pose.camera_T_board);
  }
  return robust;
}

}  // namespace firstlook
