/// By how much a camera's stamps are off from the arm's, from frames of the board taken while the arm moves.
#pragma once

#include <span>
#include <variant>
#include <vector>

#include "algorithms/calibration/depth_to_color.hpp"
#include "algorithms/calibration/hand_eye_refinement.hpp"
#include "algorithms/calibration/reprojection_terms.hpp"
#include "algorithms/kinematics/arm_model.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// The arm's joints at a time of its own clock.
struct JointSample {
  double time_s = 0;
  JointVector joints_rad;
};

/// The board in a colour image.
struct SeenPose {
  Transform<Camera, Board> camera_T_board;
  Matrix6d covariance = Matrix6d::Zero();  ///< of its pose_difference
};

/// One frame taken on the way.
struct MovingFrame {
  double stamp_s = 0;                       ///< as the camera's clock has it
  std::vector<JointSample> joints;          ///< ascending, from stamp - range to stamp + range
  std::variant<SeenPose, BoardPlane> seen;  ///< a colour camera's board, or a depth camera's plane of it
  int motion = 0;                           ///< frames of one motion have the same number
};

/// What is known of the cell when the offset is looked for.
struct TimedCell {
  ArmModel arm;
  Transform<Flange, Camera> flange_T_camera;
  Transform<Base, Board> base_T_board;
  Matrix12d covariance = Matrix12d::Zero();  ///< of both, in this order, see pose_difference
  /// What the arm says of its flange is off by so much, once for each motion and once for each frame: neighbouring
  /// configurations share most of it, and what a whole motion shares looks like an offset.
  ArmSigma arm_sigma;
  DepthMount depth;  ///< for planes
};

struct TimeOffsetOptions {
  double range_s = 0.2;        ///< offsets are looked for from - to +
  double step_s = 0.0025;      ///< of the coarse search: the board moves by less than a pixel's width in it
  double sigma_max_s = 0.002;  ///< known less well, the motion was too slow: 0.5 mm at 0.25 m/s
  int frames_min = 6;
  double wrong_frame = 1e-5;      ///< a frame that fits worse than this share of right ones do is left out
  double left_out_max = 1.0 / 3;  ///< more than this share left out: no offset explains the frames
  double misfit_max = 4;          ///< frames that scatter more than this many times their sigmas tell nothing
};

struct TimeOffset {
  double offset_s = 0;  ///< add it to the camera's stamps to have the arm's time: positive for a clock that is behind
  double sigma_s = 0;
  int frames = 0;   ///< used
  int motions = 0;  ///< that they are of
  int left_out = 0;
  double speed_max_m_s = 0;  ///< fastest of the camera's origin among the frames
  double misfit = 1;         ///< what the frames scatter over their sigmas; contained in sigma_s where above 1
};

/// Predicted pose of the board in the camera at each frame's stamp + offset against the one seen: coarse search, then
/// Gauss and Newton over the offset with the joint velocities as derivative; hand-eye, board, depth camera and a
/// deviation of the arm in each motion are solved for beside it, believed as their covariances say.
/// @return kTooFewViews for too few frames, kDegenerateMotion when the arm moved too slowly to tell, kClockWrong when
/// the offset lies beyond the range or the frames contradict every offset, kSolveFailed when they scatter too much
[[nodiscard]] Result<TimeOffset> estimate_time_offset(const TimedCell& cell, std::span<const MovingFrame> frames,
                                                      const TimeOffsetOptions& options = {});

/// The residual of a frame at an offset (measured - predicted: 6 numbers of a pose, 3 of a plane) with the derivatives
/// of the prediction. For the tests.
struct TimedTerm {
  using Residual = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 20>;
  using Covariance = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
  Residual residual;
  Jacobian by_global;     ///< offset (s), hand-eye (6), board (6), and for planes the depth camera and its scale (7)
  Covariance by_arm;      ///< deviation of the flange
  Covariance covariance;  ///< of what was seen
  double speed_m_s = 0;   ///< of the camera's origin
};
/// Empty when the joints do not cover stamp + offset or nothing of the board would be seen.
[[nodiscard]] std::optional<TimedTerm> timed_term(const TimedCell& cell, const MovingFrame& frame, double offset_s);

}  // namespace firstlook
