#include "hal/sim/ur_controller/arm_motion.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/kinematics/inverse_kinematics.hpp"

namespace firstlook::sim::ur {
namespace {

constexpr double kScaleRamp_1_s = 4;  // the slider takes effect within a quarter of a second
constexpr double kHoldRamp_1_s = 8;   // a pause within an eighth
constexpr double kSpeedMargin = 1.2;  // above the nominal joint speed the controller stops protectively
constexpr double kServoAcceleration_rad_s2 = 40;
constexpr double kSameConfiguration_rad = 0.3;  // between two cycles on a line, or over a blend
constexpr double kBrakingMin_s = 1e-3;          // what is left of braking, to divide by

/// A trapezoid over `way` of unit 1, or the one that takes `time_s`.
JointMotion along(double way, double speed, double acceleration, double time_s, const JointVector& from,
                  const JointVector& to) {
  if (time_s > 0 && way > 0) {
    const double room = acceleration * acceleration * time_s * time_s - 4 * acceleration * way;
    if (room >= 0) {
      speed = 0.5 * (acceleration * time_s - std::sqrt(room));
    } else {
      acceleration = 4 * way / (time_s * time_s);
      speed = acceleration * time_s / 2;
    }
  }
  return sim::movej(Instant{}, from, to, speed, acceleration);
}

}  // namespace

std::string_view name_of(MotionFault fault) {
  switch (fault) {
    case MotionFault::kJointLimit:
      return "a joint would leave its range";
    case MotionFault::kOutOfReach:
      return "the path leaves the reach of the arm, or passes a singularity";
    case MotionFault::kJointTooFast:
      return "a joint would be too fast";
  }
  return "";
}

ArmMotion::ArmMotion(const ArmModel& arm, const JointVector& start_rad) : arm_(arm) { place(start_rad); }

void ArmMotion::place(const JointVector& at_rad) {
  position_rad_ = at_rad;
  lock();
  slowing_rad_s2_ = velocity_rad_s_;
}

void ArmMotion::lock() {
  come_to_rest();
  velocity_rad_s_ = JointVector::zero(position_rad_.size());
  acceleration_rad_s2_ = velocity_rad_s_;
}

void ArmMotion::come_to_rest() {
  mode_ = Mode::kRest;
  held_ = false;
}

ArmMotion::Ticket ArmMotion::begin(Mode mode) {
  mode_ = mode;
  led_ = mode == Mode::kLed;
  leaving_.reset();
  return ++ticket_;
}

ArmMotion::Ticket ArmMotion::begin(Track path) {
  std::optional<Track> leaving;
  if (blending()) leaving = std::move(path_);
  path_ = std::move(path);
  const Ticket ticket = begin(Mode::kPath);
  leaving_ = std::move(leaving);
  return ticket;
}

/// The acceleration of a path that blends with the one before: while that one brakes, both together are no faster than
/// the faster of them.
double ArmMotion::gentle(double speed, double acceleration) const {
  if (!blending()) return acceleration;
  return std::min(acceleration, speed / std::max(path_.motion.duration_s() - path_.time_s, kBrakingMin_s));
}

ArmMotion::Ticket ArmMotion::movej(const JointVector& target_rad, double speed_rad_s, double acceleration_rad_s2,
                                   double time_s, const Blend& blend) {
  const JointVector from_rad = path_end_rad();
  const double way_rad = (target_rad - from_rad).max_abs();
  return begin(Track{
      .motion = along(way_rad, speed_rad_s, gentle(speed_rad_s, acceleration_rad_s2), time_s, from_rad, target_rad),
      .tool = {},
      .blend = blend,
      .at_rad = from_rad,
      .end_rad = target_rad});
}

ArmMotion::Ticket ArmMotion::follow(const ToolPath& path, double speed_m_s, double acceleration_m_s2, double time_s,
                                    const Blend& blend) {
  const double way = path.way();
  Track track{
      .motion = along(way, speed_m_s, gentle(speed_m_s, acceleration_m_s2), time_s, JointVector{0}, JointVector{way}),
      .tool = path,
      .blend = blend,
      .at_rad = path_end_rad(),
      .end_rad = {}};
  if (blend.radius_m > 0) {
    const auto end_rad = joints_of(path.end(), blend, track.at_rad);
    if (end_rad) track.end_rad = *end_rad;
    if (!end_rad) track.blend.radius_m = 0;  // it will not get there
  }
  return begin(std::move(track));
}

bool ArmMotion::blending() const {
  if (mode_ != Mode::kPath || held_ || !(path_.blend.radius_m > 0) || leaving_) return false;
  if (path_.time_s < path_.motion.duration_s() - path_.motion.phases.back().duration_s) return false;
  if ((path_.end_rad - path_.at_rad).max_abs() > kSameConfiguration_rad) return false;
  const auto tool_at = [this](const JointVector& q) {
    return Eigen::Vector3d(forward(arm_, q).flange().pose() * path_.blend.flange_T_tcp.translation());
  };
  return (tool_at(path_.end_rad) - tool_at(path_.at_rad)).norm() <= path_.blend.radius_m;
}

void ArmMotion::servoj(const JointVector& target_rad, double lookahead_s) {
  if (mode_ != Mode::kServo) static_cast<void>(begin(Mode::kServo));
  target_rad_ = target_rad;
  lookahead_s_ = lookahead_s;
}

void ArmMotion::speedj(const JointVector& speed_rad_s, double acceleration_rad_s2) {
  if (mode_ != Mode::kJointSpeed) static_cast<void>(begin(Mode::kJointSpeed));
  target_rad_ = speed_rad_s;
  acceleration_limit_ = acceleration_rad_s2;
}

void ArmMotion::speedl(const Vector6& twist, double acceleration_m_s2) {
  if (mode_ != Mode::kFlangeSpeed) static_cast<void>(begin(Mode::kFlangeSpeed));
  twist_ = twist;
  acceleration_limit_ = acceleration_m_s2;
}

bool ArmMotion::lead(const JointVector& target_rad, double speed_rad_s, double acceleration_rad_s2) {
  if (mode_ != Mode::kRest) return false;
  const double way_rad = (target_rad - position_rad_).max_abs();
  path_ = Track{.motion = along(way_rad, speed_rad_s, acceleration_rad_s2, 0, position_rad_, target_rad),
                .tool = {},
                .blend = {},
                .at_rad = position_rad_,
                .end_rad = target_rad};
  static_cast<void>(begin(Mode::kLed));
  scale_ = 1;
  return true;
}

ArmMotion::Ticket ArmMotion::stop(double deceleration_rad_s2) {
  if (mode_ == Mode::kRest) return ticket_;
  if (mode_ != Mode::kStopping) stopped_mode_ = mode_;
  mode_ = Mode::kStopping;
  held_ = false;
  acceleration_limit_ = deceleration_rad_s2;
  const double fastest_rad_s = velocity_rad_s_.max_abs();
  braking_1_s_ = fastest_rad_s > 0 ? scale_ * deceleration_rad_s2 / fastest_rad_s : 1e9;
  return ++ticket_;
}

void ArmMotion::ramp_scale(double cycle_s, double speed_fraction) {
  if (mode_ == Mode::kLed) return;
  if (mode_ == Mode::kRest) {
    scale_ = speed_fraction;
    return;
  }
  const bool stopping = mode_ == Mode::kStopping;
  const double goal = stopping || held_ ? 0 : speed_fraction;
  const double rate_1_s = stopping ? braking_1_s_ : held_ ? kHoldRamp_1_s : kScaleRamp_1_s;
  scale_ += std::clamp(goal - scale_, -rate_1_s * cycle_s, rate_1_s * cycle_s);
}

JointVector ArmMotion::toward_speed(const JointVector& speed_rad_s, double cycle_s) const {
  JointVector next_rad = position_rad_;
  for (int j = 0; j < next_rad.size(); ++j) {
    const double change =
        std::clamp(speed_rad_s[j] - velocity_rad_s_[j], -acceleration_limit_ * cycle_s, acceleration_limit_ * cycle_s);
    next_rad[j] += (velocity_rad_s_[j] + change) * cycle_s;
  }
  return next_rad;
}

JointVector ArmMotion::flange_speed(std::optional<MotionFault>& fault) const {
  const LinkFrames frames = forward(arm_, position_rad_);
  Eigen::Matrix<double, 6, 6> jacobian;
  const Eigen::Vector3d flange = frames.flange().translation();
  for (int j = 0; j < 6; ++j) {
    const Pose& link = frames.base_T_link[static_cast<std::size_t>(j)];
    const Eigen::Vector3d axis = link.linear().col(2);
    jacobian.col(j) << axis.cross(flange - link.translation()), axis;
  }
  const Eigen::FullPivLU<Eigen::Matrix<double, 6, 6>> solver(jacobian);
  JointVector speed_rad_s = JointVector::zero(6);
  if (std::abs(jacobian.determinant()) < 1e-6) {
    fault = MotionFault::kOutOfReach;
    return speed_rad_s;
  }
  const Eigen::Matrix<double, 6, 1> joints = solver.solve(Eigen::Map<const Eigen::Matrix<double, 6, 1>>(twist_.data()));
  for (int j = 0; j < 6; ++j) speed_rad_s[j] = joints[j];
  return speed_rad_s;
}

/// The posture with the tool there that is nearest to another one.
std::optional<JointVector> ArmMotion::joints_of(const Pose& base_T_tcp, const Blend& blend,
                                                const JointVector& near_rad) const {
  const Pose base_T_flange = base_T_tcp * blend.flange_T_tcp.inverse(Eigen::Isometry);
  std::optional<JointVector> nearest;
  for (const JointVector& q : inverse(arm_, Transform<Base, Flange>(base_T_flange), near_rad)) {
    if (!nearest || (q - near_rad).max_abs() < (*nearest - near_rad).max_abs()) nearest = q;
  }
  return nearest;
}

void ArmMotion::advance_on(Track& path, double step_s, std::optional<MotionFault>& fault) const {
  path.time_s += step_s;
  const JointVector along_rad = path.motion.position_rad(Instant{} + seconds(path.time_s));
  if (!path.tool) {
    path.at_rad = along_rad;
    return;
  }
  const double way = path.motion.final_s > 0 ? path.motion.direction_rad[0] : 0;
  const auto next_rad = joints_of(path.tool->at(way > 0 ? along_rad[0] / way : 1), path.blend, path.at_rad);
  if (next_rad && (*next_rad - path.at_rad).max_abs() <= kSameConfiguration_rad) {
    path.at_rad = *next_rad;
  } else {
    fault = MotionFault::kOutOfReach;
  }
}

/// Where two paths blend the arm is on the second one, and besides off it by what is left of the first.
JointVector ArmMotion::next_on_path(double step_s, std::optional<MotionFault>& fault) {
  advance_on(path_, step_s, fault);
  if (!leaving_) return path_.at_rad;
  advance_on(*leaving_, step_s, fault);
  if (leaving_->time_s >= leaving_->motion.duration_s()) {
    leaving_.reset();
    return path_.at_rad;
  }
  return path_.at_rad + (leaving_->at_rad - leaving_->end_rad);
}

JointVector ArmMotion::next(double cycle_s, std::optional<MotionFault>& fault) {
  switch (mode_ == Mode::kStopping ? stopped_mode_ : mode_) {
    case Mode::kPath:
    case Mode::kLed:
      return next_on_path(scale_ * cycle_s, fault);
    default:
      break;
  }
  if (mode_ == Mode::kStopping || held_) {
    const double limit = acceleration_limit_;
    acceleration_limit_ = mode_ == Mode::kStopping ? limit : kServoAcceleration_rad_s2;
    const JointVector braked_rad = toward_speed(JointVector::zero(6), cycle_s);
    acceleration_limit_ = limit;
    return braked_rad;
  }
  switch (mode_) {
    case Mode::kServo: {
      const double limit = acceleration_limit_;
      acceleration_limit_ = kServoAcceleration_rad_s2;
      JointVector speed_rad_s = (target_rad_ - position_rad_) * (1 / std::max(lookahead_s_, 2 * cycle_s));
      for (int j = 0; j < 6; ++j) {
        const double fastest = arm_.speed_max_rad_s[static_cast<std::size_t>(j)];
        speed_rad_s[j] = std::clamp(speed_rad_s[j], -fastest, fastest);
      }
      const JointVector next_rad = toward_speed(speed_rad_s, cycle_s);
      acceleration_limit_ = limit;
      return next_rad;
    }
    case Mode::kJointSpeed:
      return toward_speed(target_rad_ * scale_, cycle_s);
    case Mode::kFlangeSpeed:
      // An acceleration of the flange is one of the joints for an arm of about a metre.
      return toward_speed(flange_speed(fault) * scale_, cycle_s);
    default:
      return position_rad_;
  }
}

std::optional<MotionFault> ArmMotion::check(const JointVector& next_rad, double cycle_s) const {
  for (int j = 0; j < next_rad.size(); ++j) {
    const auto i = static_cast<std::size_t>(j);
    const double step_rad = std::abs(next_rad[j] - position_rad_[j]);
    if (step_rad > kSpeedMargin * arm_.speed_max_rad_s[i] * cycle_s) return MotionFault::kJointTooFast;
    const bool outward = std::abs(next_rad[j]) > std::abs(position_rad_[j]);
    if (outward && (next_rad[j] > 2 * M_PI || next_rad[j] < -2 * M_PI)) return MotionFault::kJointLimit;
  }
  return std::nullopt;
}

JointVector ArmMotion::true_position_rad() const {
  return rested_s_ > 0 ? position_rad_ + ring_down_rad(slowing_rad_s2_, rested_s_) : position_rad_;
}

/// The structure swings once the arm has come to rest, by how hard it braked: the last cycle of a motion is not a whole
/// one, the one before it tells.
void ArmMotion::follow_structure(double cycle_s) {
  if (mode_ == Mode::kRest || standing()) {
    rested_s_ += cycle_s;
  } else {
    rested_s_ = 0;
    slowing_rad_s2_ = acceleration_rad_s2_ * -1;
  }
}

std::optional<MotionFault> ArmMotion::step(double cycle_s, double speed_fraction) {
  const auto fault = advance(cycle_s, speed_fraction);
  follow_structure(cycle_s);
  return fault;
}

std::optional<MotionFault> ArmMotion::advance(double cycle_s, double speed_fraction) {
  ramp_scale(cycle_s, speed_fraction);
  if (mode_ == Mode::kRest) {
    velocity_rad_s_ = acceleration_rad_s2_ = JointVector::zero(position_rad_.size());
    return std::nullopt;
  }
  std::optional<MotionFault> fault;
  const JointVector next_rad = next(cycle_s, fault);
  if (!fault) fault = check(next_rad, cycle_s);
  if (fault) {
    lock();
    return fault;
  }
  const JointVector velocity_rad_s = (next_rad - position_rad_) * (1 / cycle_s);
  acceleration_rad_s2_ = (velocity_rad_s - velocity_rad_s_) * (1 / cycle_s);
  velocity_rad_s_ = velocity_rad_s;
  position_rad_ = next_rad;

  const bool on_path = mode_ == Mode::kPath || mode_ == Mode::kLed;
  if (on_path && !leaving_ && path_.time_s >= path_.motion.duration_s()) come_to_rest();
  if (mode_ == Mode::kStopping && standing()) come_to_rest();
  return std::nullopt;
}

}  // namespace firstlook::sim::ur
