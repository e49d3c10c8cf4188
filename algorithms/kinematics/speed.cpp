#include "algorithms/kinematics/speed.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/kinematics/twist.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr double kTightness = 1.03;  // bound over a speed that is reached
constexpr int kDepthMax = 14;

/// Largest speed that any point of the placed capsule has. A ball of radius r about a point with velocity v turns with
/// w: its fastest point moves with |v_parallel| along w and |v_across| + |w| r across it. Convex along the axis, so an
/// end of it decides.
double capsule_speed(const LinkTwists& twists, const Capsule& placed) {
  const Eigen::Vector3d& w = twists.angular[static_cast<std::size_t>(placed.link)];
  const double turn = w.norm();
  double fastest = 0;  // squared
  for (const Eigen::Vector3d* end : {&placed.a, &placed.b}) {
    const Eigen::Vector3d v = twists.velocity(placed.link, *end);
    const double along = turn > 0 ? v.dot(w) / turn : 0;
    const double across = std::sqrt(std::max(0.0, v.squaredNorm() - along * along));
    const double widest = across + turn * placed.radius_m;
    fastest = std::max(fastest, along * along + widest * widest);
  }
  return std::sqrt(fastest);
}

class SpeedSearch {
 public:
  SpeedSearch(const ArmModel& arm, const Capsules& body, const JointVector& from, const JointVector& to)
      : arm_(arm), body_(body), from_(from), dq_(to - from) {
    bends_.resize(body.size());
  }

  /// The highest speed that any point of the body has at these places.
  double reached_at(std::initializer_list<double> places) {
    for (const double t : places) look(t, 0);
    return reached_;
  }

  double bound() {
    for (std::size_t i = 0; i < body_.size(); ++i) {
      const Capsule& c = body_[i];
      bends_[i] = second_derivative_bound(lever_arms(arm_, c), c.link, dq_, c.radius_m);
    }
    reached_at({0, 0.25, 0.5, 0.75, 1});
    for (int i = 0; i < 4; ++i) split(0.125 + 0.25 * i, 0.125, 0);
    return bound_;
  }

 private:
  /// Bound over [t - half, t + half]; raises the speed that is known to be reached.
  double look(double t, double half) {
    const LinkFrames frames = forward(arm_, from_ + dq_ * t);
    const LinkTwists twists = link_twists(frames, dq_);
    double upper = 0;
    for (std::size_t i = 0; i < body_.size(); ++i) {
      Capsule c = body_[i];
      const Pose& base_T_link = frames.base_T_link[static_cast<std::size_t>(c.link)];
      c.a = base_T_link * c.a;
      c.b = base_T_link * c.b;
      const double speed = capsule_speed(twists, c);
      reached_ = std::max(reached_, speed);
      upper = std::max(upper, speed + half * bends_[i]);
    }
    return upper;
  }

  void split(double t, double half, int depth) {
    const double upper = look(t, half);
    if (upper <= kTightness * reached_ || depth == kDepthMax) {
      bound_ = std::max(bound_, upper);
      return;
    }
    split(t - half / 2, half / 2, depth + 1);
    split(t + half / 2, half / 2, depth + 1);
  }

  const ArmModel& arm_;
  const Capsules& body_;
  JointVector from_;
  JointVector dq_;
  FixedVector<double, kCapsulesMax> bends_;
  double reached_ = 0;
  double bound_ = 0;
};

}  // namespace

double speed_bound_m_per_unit(const ArmModel& arm, const Capsules& body, const JointVector& from,
                              const JointVector& to) {
  if (from == to) return 0;
  return SpeedSearch(arm, body, from, to).bound();
}

double SegmentTiming::fraction_at(double t_s) const {
  if (t_s <= 0) return 0;
  if (t_s >= duration_s) return 1;
  const double a = leading_acceleration_rad_s2;
  const double ramp_s = std::min(leading_speed_rad_s / a, duration_s / 2);
  const double rest_s = duration_s - t_s;
  double angle = 0;
  if (t_s < ramp_s) {
    angle = a * t_s * t_s / 2;
  } else if (rest_s < ramp_s) {
    angle = leading_angle_rad - a * rest_s * rest_s / 2;
  } else {
    angle = a * ramp_s * (t_s - ramp_s / 2);
  }
  return std::clamp(angle / leading_angle_rad, 0.0, 1.0);
}

double SegmentTiming::fraction_rate_at(double t_s) const {
  if (t_s <= 0 || t_s >= duration_s) return 0;
  const double a = leading_acceleration_rad_s2;
  const double ramp_s = std::min(leading_speed_rad_s / a, duration_s / 2);
  return a * std::min({t_s, ramp_s, duration_s - t_s}) / leading_angle_rad;
}

namespace {

/// The fastest move when no point of the body goes faster than `reach_m` for each unit of the path parameter.
SegmentTiming fastest_move(const ArmModel& arm, const JointVector& from, const JointVector& to, double reach_m,
                           const SpeedLimits& limits) {
  SegmentTiming timing;
  timing.from = from;
  timing.to = to;
  const JointVector dq = to - from;
  const double angle = dq.max_abs();
  double speed = limits.joint_speed_rad_s;
  if (reach_m > 0) speed = std::min(speed, limits.body_speed_m_s * angle / reach_m);
  for (int j = 0; j < arm.joints; ++j) {
    if (dq[j] != 0) speed = std::min(speed, arm.speed_max_rad_s[static_cast<std::size_t>(j)] * angle / std::abs(dq[j]));
  }
  const double acceleration = std::min(limits.joint_acceleration_rad_s2, arm.acceleration_max_rad_s2);
  const double peak = std::min(speed, std::sqrt(acceleration * angle));  // a short move never reaches its speed
  timing.leading_angle_rad = angle;
  timing.leading_speed_rad_s = speed;
  timing.leading_acceleration_rad_s2 = acceleration;
  timing.duration_s = angle / peak + peak / acceleration;
  timing.body_speed_bound_m_s = reach_m * peak / angle;
  return timing;
}

}  // namespace

SegmentTiming time_segment(const ArmModel& arm, const Capsules& body, const JointVector& from, const JointVector& to,
                           const SpeedLimits& limits) {
  ENSURE(4011, limits.body_speed_m_s > 0 && limits.joint_speed_rad_s > 0 && limits.joint_acceleration_rad_s2 > 0);
  if (from == to) return {.from = from, .to = to};
  return fastest_move(arm, from, to, speed_bound_m_per_unit(arm, body, from, to), limits);
}

double least_duration_s(const ArmModel& arm, const Capsules& body, const JointVector& from, const JointVector& to,
                        const SpeedLimits& limits) {
  ENSURE(4012, limits.body_speed_m_s > 0 && limits.joint_speed_rad_s > 0 && limits.joint_acceleration_rad_s2 > 0);
  if (from == to) return 0;
  const double reached_m = SpeedSearch(arm, body, from, to).reached_at({0, 0.5, 1});
  return fastest_move(arm, from, to, reached_m, limits).duration_s;
}

}  // namespace firstlook
