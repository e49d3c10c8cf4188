#include "algorithms/calibration/time_offset.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

#include "algorithms/calibration/chi_square.hpp"
#include "algorithms/kinematics/twist.hpp"

namespace firstlook {
namespace {

constexpr int kPoseGlobals = 13, kPlaneGlobals = 20;
constexpr int kIterationsMax = 30;
constexpr double kSettled_s = 1e-8;

/// Joints and their velocities at a time, linear between samples.
struct JointState {
  JointVector position_rad, velocity_rad_s;
};

std::optional<JointState> joints_at(std::span<const JointSample> samples, double time_s) {
  const auto after = std::upper_bound(samples.begin(), samples.end(), time_s,
                                      [](double t, const JointSample& sample) { return t < sample.time_s; });
  if (after == samples.begin() || after == samples.end()) return std::nullopt;
  const auto before = after - 1;
  const double length_s = after->time_s - before->time_s;
  if (!(length_s > 0)) return std::nullopt;
  return JointState{interpolate(before->joints_rad, after->joints_rad, (time_s - before->time_s) / length_s),
                    (after->joints_rad - before->joints_rad) * (1 / length_s)};
}

/// Predicted camera_T_board with its derivatives.
struct Prediction {
  Pose camera_T_board;
  Matrix6d by_arm, by_hand_eye, by_board;
  Vector6d by_time;
  double speed_m_s = 0;
};

Prediction predict(const TimedCell& cell, const JointState& joints) {
  const LinkFrames frames = forward(cell.arm, joints.position_rad);
  const Pose flange = frames.flange().pose();
  const Pose base_T_camera = flange * cell.flange_T_camera.pose();
  Prediction p;
  p.camera_T_board = base_T_camera.inverse(Eigen::Isometry) * cell.base_T_board.pose();
  // A further pose_difference of base_T_camera, then what makes it: a turn of the flange moves the camera, too.
  const Eigen::Matrix3d camera_R_base = base_T_camera.linear().transpose();
  const Eigen::Vector3d lever = cell.base_T_board.translation() - base_T_camera.translation();
  Matrix6d by_camera = Matrix6d::Zero();
  by_camera.topLeftCorner<3, 3>() = -camera_R_base;
  by_camera.topRightCorner<3, 3>() = camera_R_base * cross_matrix(lever);
  by_camera.bottomRightCorner<3, 3>() = -camera_R_base;
  Matrix6d camera_by_arm = Matrix6d::Identity();
  camera_by_arm.topRightCorner<3, 3>() = -cross_matrix(flange.linear() * cell.flange_T_camera.translation());
  Matrix6d camera_by_hand_eye = Matrix6d::Zero();
  camera_by_hand_eye.topLeftCorner<3, 3>() = flange.linear();
  camera_by_hand_eye.bottomRightCorner<3, 3>() = flange.linear();
  p.by_arm = by_camera * camera_by_arm;
  p.by_hand_eye = by_camera * camera_by_hand_eye;
  p.by_board = Matrix6d::Zero();
  p.by_board.topLeftCorner<3, 3>() = camera_R_base;
  p.by_board.bottomRightCorner<3, 3>() = camera_R_base;

  const LinkTwists twists = link_twists(frames, joints.velocity_rad_s);
  Vector6d flange_rate;
  flange_rate << twists.velocity(frames.joints, flange.translation()),
      twists.angular[static_cast<std::size_t>(frames.joints)];
  p.by_time = p.by_arm * flange_rate;
  p.speed_m_s = twists.velocity(frames.joints, base_T_camera.translation()).norm();
  return p;
}

TimedTerm pose_term(const Prediction& p, const SeenPose& seen) {
  TimedTerm term;
  term.residual = pose_difference(seen.camera_T_board.pose(), p.camera_T_board);
  term.by_global.resize(6, kPoseGlobals);
  term.by_global << p.by_time, p.by_hand_eye, p.by_board;
  term.by_arm = p.by_arm;
  term.covariance = seen.covariance;
  term.speed_m_s = p.speed_m_s;
  return term;
}

std::optional<TimedTerm> plane_term(const Prediction& p, const DepthMount& mount, const BoardPlane& seen) {
  const auto plane = expected_plane(mount.camera_T_depth.pose(), p.camera_T_board);
  if (!plane) return std::nullopt;
  const double scale = mount.depth_scale;
  const Eigen::Matrix<double, 3, 6> by_pose = plane->by_camera_T_board / scale;
  TimedTerm term;
  term.residual = seen.inverse_depth - plane->inverse_depth / scale;
  term.by_global.resize(3, kPlaneGlobals);
  term.by_global << by_pose * p.by_time, by_pose * p.by_hand_eye, by_pose * p.by_board,
      plane->by_camera_T_depth / scale, -plane->inverse_depth / (scale * scale);
  term.by_arm = by_pose * p.by_arm;
  term.covariance = seen.noise * seen.noise * seen.unit_information.inverse();
  term.speed_m_s = p.speed_m_s;
  return term;
}

Vector6d arm_variances(const ArmSigma& sigma) {
  Vector6d v;
  v << Eigen::Vector3d::Constant(sigma.translation_m * sigma.translation_m),
      Eigen::Vector3d::Constant(sigma.rotation_rad * sigma.rotation_rad);
  return v;
}

/// The linear least squares at one offset: how far the offset is from the best, and what the frames then leave.
struct Solution {
  double step_s = 0;
  double sigma_s = 0;
  double cost = 0;
  std::vector<double> chi2;  ///< of each frame used, in their order
};

struct Problem {
  const TimedCell& cell;
  std::span<const MovingFrame> frames;
  std::vector<bool> used{};
  int globals = kPoseGlobals;
  Eigen::MatrixXd belief{};      ///< information of the globals; nothing is known of the first, the offset
  Eigen::MatrixXd covariance{};  ///< of those after the first
  Vector6d arm_variance = Vector6d::Zero();
};

/// Information of what was seen, with the arm's deviation in this frame.
TimedTerm::Covariance information_of(const TimedTerm& term, const Vector6d& arm_variance) {
  const TimedTerm::Covariance sum = term.covariance + term.by_arm * arm_variance.asDiagonal() * term.by_arm.transpose();
  return sum.inverse();
}

/// Normal equations of one motion: its deviation of the arm is eliminated (Schur complement).
struct Motion {
  Eigen::MatrixXd coupling;  ///< globals x 6
  Matrix6d own = Matrix6d::Zero();
  Vector6d own_right = Vector6d::Zero();
};

std::optional<Solution> solve_at(const Problem& problem, double offset_s) {
  struct Part {
    TimedTerm term;
    TimedTerm::Covariance information;
    int motion = 0;
  };
  std::vector<Part> parts;
  std::map<int, Motion> motions;
  Eigen::MatrixXd information = problem.belief;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(problem.globals);
  for (std::size_t i = 0; i < problem.frames.size(); ++i) {
    if (!problem.used[i]) continue;
    const auto term = timed_term(problem.cell, problem.frames[i], offset_s);
    if (!term) return std::nullopt;
    parts.push_back({*term, information_of(*term, problem.arm_variance), problem.frames[i].motion});
    const Part& part = parts.back();
    Motion& motion = motions[part.motion];
    if (motion.coupling.size() == 0) {
      motion.coupling = Eigen::MatrixXd::Zero(problem.globals, 6);
      motion.own.diagonal() = problem.arm_variance.cwiseInverse();
    }
    const Eigen::MatrixXd gain = term->by_global.transpose() * part.information;
    const Eigen::Index size = gain.rows();  // frames of a colour camera do not lean on the depth camera
    information.topLeftCorner(size, size) += gain * term->by_global;
    right.head(size) += gain * term->residual;
    motion.coupling.topRows(size) += gain * term->by_arm;
    motion.own += term->by_arm.transpose() * part.information * term->by_arm;
    motion.own_right += term->by_arm.transpose() * part.information * term->residual;
  }
  for (const auto& [number, motion] : motions) {
    const Eigen::MatrixXd share = motion.own.ldlt().solve(motion.coupling.transpose()).transpose();
    information -= share * motion.coupling.transpose();
    right -= share * motion.own_right;
  }
  // Rows have different units.
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(scale.asDiagonal() * information * scale.asDiagonal());
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 1e-14)) return std::nullopt;
  const Eigen::VectorXd globals = scale.cwiseProduct(ldlt.solve(scale.cwiseProduct(right)));
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(problem.globals, 0);
  Solution solution;
  solution.step_s = globals[0];
  solution.sigma_s = scale[0] * std::sqrt(ldlt.solve(unit)[0]);
  if (!std::isfinite(solution.step_s) || !std::isfinite(solution.sigma_s)) return std::nullopt;

  std::map<int, Vector6d> deviations;
  solution.cost = globals.dot(problem.belief * globals);
  for (const auto& [number, motion] : motions) {
    const Vector6d d = motion.own.ldlt().solve(motion.own_right - motion.coupling.transpose() * globals);
    solution.cost += problem.arm_variance.cwiseInverse().dot(d.cwiseAbs2());
    deviations[number] = d;
  }
  for (const Part& part : parts) {
    const TimedTerm::Residual left = part.term.residual -
                                     part.term.by_global * globals.head(part.term.by_global.cols()) -
                                     part.term.by_arm * deviations[part.motion];
    solution.chi2.push_back(left.dot(part.information * left));
    solution.cost += solution.chi2.back();
  }
  return solution;
}

/// Squares at an offset with everything but the offset as believed, each frame's share bounded: a board that was taken
/// for another does not decide.
double coarse_cost(const Problem& problem, double offset_s) {
  constexpr double kBound = 400;  // 20 sigmas
  double cost = 0;
  for (std::size_t i = 0; i < problem.frames.size(); ++i) {
    const auto term = timed_term(problem.cell, problem.frames[i], offset_s);
    if (!term) return std::numeric_limits<double>::infinity();
    const auto rest = term->by_global.rightCols(term->by_global.cols() - 1);
    const TimedTerm::Covariance believed =
        rest * problem.covariance.topLeftCorner(rest.cols(), rest.cols()) * rest.transpose();
    const TimedTerm::Covariance sum =
        term->covariance + believed + 2 * (term->by_arm * problem.arm_variance.asDiagonal() * term->by_arm.transpose());
    cost += std::min(kBound, term->residual.dot(sum.inverse() * term->residual));
  }
  return cost;
}

Result<double> coarse_offset(const Problem& problem, const TimeOffsetOptions& options) {
  const int steps = static_cast<int>(std::floor(options.range_s / options.step_s + 1e-9));
  int best = 0;
  double lowest = std::numeric_limits<double>::infinity();
  for (int k = -steps; k <= steps; ++k) {
    const double cost = coarse_cost(problem, k * options.step_s);
    if (cost < lowest) {
      lowest = cost;
      best = k;
    }
  }
  if (!std::isfinite(lowest)) return failure(Fault::kSolveFailed, "the board's expected place is not finite");
  return best * options.step_s;
}

/// Gauss and Newton from `offset_s` on.
std::optional<Solution> refined(const Problem& problem, double range_s, double& offset_s) {
  constexpr double kStepMax_s = 0.02;
  for (int i = 0; i < kIterationsMax; ++i) {
    auto solution = solve_at(problem, offset_s);
    if (!solution) return std::nullopt;
    offset_s = std::clamp(offset_s + std::clamp(solution->step_s, -kStepMax_s, kStepMax_s), -range_s, range_s);
    if (std::abs(solution->step_s) < kSettled_s) return solution;
  }
  return solve_at(problem, offset_s);
}

int rows_of(const MovingFrame& frame) { return std::holds_alternative<SeenPose>(frame.seen) ? 6 : 3; }

/// Takes out the frame that fits worst when it cannot be right.
bool leave_out_worst(Problem& problem, const Solution& solution, double wrong_share) {
  double worst = 1;
  std::size_t which = problem.frames.size(), k = 0;
  for (std::size_t i = 0; i < problem.frames.size(); ++i) {
    if (!problem.used[i]) continue;
    const double over = solution.chi2[k++] / chi_square_quantile(1 - wrong_share, rows_of(problem.frames[i]));
    if (over > worst) {
      worst = over;
      which = i;
    }
  }
  if (which == problem.frames.size()) return false;
  problem.used[which] = false;
  return true;
}

bool is_finite(const MovingFrame& frame) {
  if (!std::isfinite(frame.stamp_s)) return false;
  if (const auto* pose = std::get_if<SeenPose>(&frame.seen)) {
    return pose->camera_T_board.pose().matrix().allFinite() && pose->covariance.allFinite();
  }
  const auto& plane = std::get<BoardPlane>(frame.seen);
  return plane.inverse_depth.allFinite() && plane.noise > 0 && plane.unit_information.allFinite();
}

bool covers(const MovingFrame& frame, double range_s) {
  return joints_at(frame.joints, frame.stamp_s - range_s) && joints_at(frame.joints, frame.stamp_s + range_s);
}

Result<Problem> problem_of(const TimedCell& cell, std::span<const MovingFrame> frames,
                           const TimeOffsetOptions& options) {
  Problem problem{.cell = cell, .frames = frames};
  int pictures = 0, covered = 0;
  for (const MovingFrame& frame : frames) {
    const bool finite = is_finite(frame);
    pictures += finite ? 1 : 0;
    problem.used.push_back(finite && covers(frame, options.range_s));
    covered += problem.used.back() ? 1 : 0;
    if (finite && rows_of(frame) == 3) problem.globals = kPlaneGlobals;
  }
  if (pictures < options.frames_min) {
    return failure(Fault::kTooFewViews, "the board was seen in {} frames on the way, {} are needed", pictures,
                   options.frames_min);
  }
  if (covered < options.frames_min) {
    return failure(Fault::kTooFewViews, "the arm's joints are known around {} of {} frames, {} are needed", covered,
                   pictures, options.frames_min);
  }
  const int others = problem.globals - 1;
  problem.covariance = Eigen::MatrixXd::Zero(others, others);
  problem.covariance.topLeftCorner<12, 12>() = cell.covariance;
  if (problem.globals == kPlaneGlobals) problem.covariance.bottomRightCorner<7, 7>() = cell.depth.covariance;
  problem.belief = Eigen::MatrixXd::Zero(problem.globals, problem.globals);
  problem.belief.bottomRightCorner(others, others) = problem.covariance.inverse();
  problem.arm_variance = arm_variances(cell.arm_sigma);
  if (!problem.belief.allFinite() || !(problem.arm_variance.minCoeff() > 0)) {
    return failure(Fault::kSolveFailed, "hand-eye, board, depth camera and arm need covariances above 0");
  }
  return problem;
}

/// The frames that can be used, alone.
std::vector<MovingFrame> usable(std::span<const MovingFrame> frames, const std::vector<bool>& used) {
  std::vector<MovingFrame> list;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (used[i]) list.push_back(frames[i]);
  }
  return list;
}

TimeOffset summed_up(const Problem& problem, const Solution& solution, double offset_s) {
  TimeOffset result;
  result.offset_s = offset_s;
  int rows = 0;
  std::map<int, int> motions;
  for (std::size_t i = 0; i < problem.frames.size(); ++i) {
    const MovingFrame& frame = problem.frames[i];
    if (!problem.used[i]) {
      ++result.left_out;
      continue;
    }
    ++result.frames;
    ++motions[frame.motion];
    rows += rows_of(frame);
    const auto term = timed_term(problem.cell, frame, offset_s);
    if (term) result.speed_max_m_s = std::max(result.speed_max_m_s, term->speed_m_s);
  }
  result.motions = static_cast<int>(motions.size());
  result.misfit = std::sqrt(solution.cost / std::max(1, rows - 1));
  result.sigma_s = solution.sigma_s * std::max(1.0, result.misfit);
  return result;
}

}  // namespace

std::optional<TimedTerm> timed_term(const TimedCell& cell, const MovingFrame& frame, double offset_s) {
  const auto joints = joints_at(frame.joints, frame.stamp_s + offset_s);
  if (!joints) return std::nullopt;
  const Prediction prediction = predict(cell, *joints);
  if (const auto* pose = std::get_if<SeenPose>(&frame.seen)) return pose_term(prediction, *pose);
  return plane_term(prediction, cell.depth, std::get<BoardPlane>(frame.seen));
}

Result<TimeOffset> estimate_time_offset(const TimedCell& cell, std::span<const MovingFrame> frames,
                                        const TimeOffsetOptions& options) {
  const auto all = problem_of(cell, frames, options);
  if (!all) return std::unexpected(all.error());
  const std::vector<MovingFrame> taken = usable(frames, all->used);
  Problem problem = *all;
  problem.frames = taken;
  problem.used.assign(taken.size(), true);
  const auto coarse = coarse_offset(problem, options);
  if (!coarse) return std::unexpected(coarse.error());

  double offset_s = *coarse;
  std::optional<Solution> solution;
  std::size_t left_out = 0;
  do {
    solution = refined(problem, options.range_s, offset_s);
    if (!solution) {
      return failure(Fault::kDegenerateMotion, "the {} frames on the way tell no offset: the arm did not move",
                     taken.size() - left_out);
    }
    left_out = static_cast<std::size_t>(std::count(problem.used.begin(), problem.used.end(), false));
    if (static_cast<double>(left_out) > options.left_out_max * static_cast<double>(taken.size())) {
      return failure(Fault::kClockWrong, "no offset of the stamps explains {} of {} frames on the way", left_out,
                     taken.size());
    }
  } while (leave_out_worst(problem, *solution, options.wrong_frame));

  TimeOffset result = summed_up(problem, *solution, offset_s);
  if (result.misfit > options.misfit_max) {
    return failure(Fault::kSolveFailed, "the frames on the way scatter {:.1f} times as much as their sigmas say",
                   result.misfit);
  }
  if (result.sigma_s > options.sigma_max_s) {
    return failure(Fault::kDegenerateMotion,
                   "the arm moved too slowly: {:.0f} mm/s at most tell the offset to {:.1f} ms, {:.1f} ms are needed",
                   1000 * result.speed_max_m_s, 1000 * result.sigma_s, 1000 * options.sigma_max_s);
  }
  if (std::abs(offset_s) > options.range_s - options.step_s) {
    return failure(Fault::kClockWrong, "the stamps are off by more than {:.0f} ms", 1000 * options.range_s);
  }
  return result;
}

}  // namespace firstlook
