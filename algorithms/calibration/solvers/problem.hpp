/// What every hand-eye solver starts from: views in an order of their own, relative motions, quaternions with matching
/// signs. Prepared and checked once.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

using Matrix3x4d = Eigen::Matrix<double, 3, 4>;

/// What a solver gives: the hand-eye transform always, the rest when its equation contains it.
struct HandEyeSolution {
  Transform<Flange, Camera> flange_T_camera;
  std::optional<Transform<Base, Board>> base_T_board;  ///< by the solvers of AX = YB
  /// [R t] as the linear system gave it, before R was made a rotation; by the linear solvers.
  std::optional<Matrix3x4d> raw_flange_T_camera, raw_base_T_board;
};

/// How much the flange turned among the views: what the hand-eye transform can be told from. Half turns (beyond 170
/// degrees; 179 when nothing else is there) do not count: the axis of a noisy one has no sure sign.
struct MotionDiversity {
  int axes = 0;                ///< independent rotation axes found (0, 1 or 2): 2 are needed
  double angle_max_rad = 0;    ///< largest rotation between two views, half turns included
  double second_axis_rad = 0;  ///< RMS rotation about the second of the two strongest axes: the weak direction
};
/// Counts motions between views of the same target.
[[nodiscard]] MotionDiversity motion_diversity(std::span<const PosePair> pairs);

}  // namespace firstlook

namespace firstlook::solvers {

/// One view as A P = Q B with P = base_T_board and Q = flange_T_camera. Of the equivalent ways to write AX = YB this
/// one compares where the board's origin is: camera_T_board knows that well, its inverse multiplies the noise of its
/// rotation by the distance.
struct View {
  Pose a;  ///< flange_T_base
  Pose b;  ///< camera_T_board
  /// Their rotations (w, x, y, z), with signs such that qa p = q qb for one p and one q.
  Eigen::Vector4d qa = Eigen::Vector4d::Zero(), qb = Eigen::Vector4d::Zero();
};

/// Motions between two views: A X = X B with X = flange_T_camera.
struct Motion {
  Pose a, b;                    ///< of flange and camera
  Eigen::Vector3d alpha, beta;  ///< their rotation vectors, rad
  Eigen::Vector4d qa, qb;       ///< their rotations (w, x, y, z), with signs such that qa x = x qb
  bool clear = false;           ///< no half turn: the axis of a noisy one has no sure sign
};

struct Problem {
  std::vector<PosePair> pairs;  ///< sorted by their numbers: the order in which views were taken means nothing
  std::vector<View> views;
  /// Between every two views of one target, there and back: with noise these are not quite the same.
  std::vector<Motion> motions;
};

struct Requirements {
  int poses_min = 3;
  bool board_rotation = true;  ///< false: the rotation of camera_T_board may be missing (not a number)
};

/// Sorts and checks the views; motions and quaternions only when the rotation of the board is required.
/// @return kTooFewViews; kDegenerateMotion when flange or camera turn about fewer than two axes (second axis below 1
/// degree RMS); kSolveFailed for poses that are not finite or not rigid
[[nodiscard]] Result<Problem> prepare(std::span<const PosePair> pairs, const Requirements& requirements);

/// kDegenerateMotion when the flange turns about one point of itself that stands still (within 2 mm RMS), as a wrist
/// does: then every scale of the rotation meets the equations of a linear solver of rotation and translation together.
[[nodiscard]] Status check_not_about_one_point(const Problem& problem);

/// kDegenerateMotion when the linear solution's matrix is too far from a rotation (singular values outside 0.8 .. 1.25)
/// to be one with noise.
[[nodiscard]] Status check_near_rotation(const Eigen::Matrix3d& raw);

}  // namespace firstlook::solvers
