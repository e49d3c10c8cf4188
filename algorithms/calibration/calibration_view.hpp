/// What calibration is computed from.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "algorithms/vision/rotation.hpp"
#include "algorithms/vision/target.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// One view of the board: where the arm said the flange was, and the board's points that the camera saw.
struct CalibrationView {
  Transform<Base, Flange> base_T_flange;
  std::vector<Eigen::Vector2d> corners_px;
  std::vector<int> ids{};  ///< the point that each of them is, ascending; empty: all points of the board, in order
  int target = 0;          ///< which of the targets (Targets) it shows; a picture of two is two views
  /// Views with the same number were taken from one place of the arm and share its deviation; -1: a place of its own.
  int station = -1;

  [[nodiscard]] SeenPoints points() const { return {corners_px, ids}; }
};

/// One view reduced to two poses.
struct PosePair {
  Transform<Base, Flange> base_T_flange;
  Transform<Camera, Board> camera_T_board;
  int target = 0;  ///< as in CalibrationView
  int station = -1;
};

/// One more than the largest number of a target among them; 1 for none.
[[nodiscard]] int target_count(std::span<const PosePair> pairs);
/// Those of one target, in their order.
[[nodiscard]] std::vector<PosePair> pairs_of_target(std::span<const PosePair> pairs, int target);
/// For each of them the place of the arm it was taken from, counted 0, 1, ... in the order in which they first appear.
[[nodiscard]] std::vector<std::size_t> stations_of(std::span<const PosePair> pairs);
/// How many places these are.
[[nodiscard]] std::size_t station_count(std::span<const std::size_t> stations);

/// How far `estimate` lies from `truth`: (t_truth - t_estimate, Log(R_truth R_estimate^T)), metres and radians in the
/// parent frame. Every covariance of a transform in this folder is that of this difference (left perturbation:
/// R = Exp(d_r) R_est, t = t_est + d_t).
[[nodiscard]] Vector6d pose_difference(const Pose& truth, const Pose& estimate);

/// Inverse of pose_difference: the truth from an estimate and a difference.
[[nodiscard]] Pose perturb(const Pose& estimate, const Vector6d& difference);

}  // namespace firstlook
