#include "hal/sim/joint_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "platform/core/ensure.hpp"

namespace firstlook::sim {
namespace {

// After a stop the flange swings about its rest: the deflection a / w² of the last deceleration, at most 1.2 mrad,
// decays with 0.12 s. A UR5's flange, 0.9 m from the base axis, starts at 1.1 mm and is below 0.1 mm after 0.3 s.
constexpr double kRing_rad_s = 2 * std::numbers::pi * 6;
constexpr double kRingDecay_s = 0.12;
constexpr double kRingMax_rad = 1.2e-3;
constexpr double kRingForgotten_s = 2;

}  // namespace

double JointMotion::duration_s() const { return phases[0].duration_s + phases[1].duration_s + phases[2].duration_s; }

bool JointMotion::moving(Instant now) const { return (now - start).seconds() < duration_s(); }

void JointMotion::path_at(double t_s, double& s, double& rate_1_s) const {
  rate_1_s = 0;
  s = phases[0].s;
  if (t_s <= 0) return;
  for (const Phase& phase : phases) {
    if (t_s < phase.duration_s) {
      s = phase.s + (phase.rate_1_s + 0.5 * phase.acceleration_1_s2 * t_s) * t_s;
      rate_1_s = phase.rate_1_s + phase.acceleration_1_s2 * t_s;
      return;
    }
    t_s -= phase.duration_s;
  }
  s = final_s;
}

JointVector JointMotion::position_rad(Instant now) const {
  double s = 0, rate = 0;
  path_at((now - start).seconds(), s, rate);
  return origin_rad + direction_rad * s;
}

JointVector JointMotion::velocity_rad_s(Instant now) const {
  double s = 0, rate = 0;
  path_at((now - start).seconds(), s, rate);
  return direction_rad * rate;
}

JointVector JointMotion::true_position_rad(Instant now) const {
  const JointVector commanded = position_rad(now);
  const double after_s = (now - start).seconds() - duration_s();
  if (after_s < 0 || after_s > kRingForgotten_s) return commanded;
  return commanded + ring_down_rad(direction_rad * std::abs(phases[2].acceleration_1_s2), after_s);
}

JointVector ring_down_rad(const JointVector& deceleration_rad_s2, double after_s) {
  const double leading_rad_s2 = deceleration_rad_s2.max_abs();
  if (after_s < 0 || after_s > kRingForgotten_s || leading_rad_s2 <= 0) {
    return JointVector::zero(deceleration_rad_s2.size());
  }
  const double amplitude_rad = std::min(leading_rad_s2 / (kRing_rad_s * kRing_rad_s), kRingMax_rad);
  const double swing_rad = amplitude_rad * std::exp(-after_s / kRingDecay_s) * std::sin(kRing_rad_s * after_s);
  return deceleration_rad_s2 * (swing_rad / leading_rad_s2);
}

JointMotion rest(Instant start, const JointVector& at_rad) {
  JointMotion motion;
  motion.start = start;
  motion.origin_rad = at_rad;
  motion.direction_rad = JointVector::zero(at_rad.size());
  return motion;
}

JointMotion movej(Instant start, const JointVector& from_rad, const JointVector& to_rad, double speed_rad_s,
                  double acceleration_rad_s2) {
  ENSURE(5001, speed_rad_s > 0 && acceleration_rad_s2 > 0);
  JointMotion motion = rest(start, from_rad);
  const double leading_rad = (to_rad - from_rad).max_abs();
  if (leading_rad <= 0) return motion;
  motion.direction_rad = to_rad - from_rad;
  motion.final_s = 1;
  const double acceleration = acceleration_rad_s2 / leading_rad;
  const double rate = std::min(speed_rad_s / leading_rad, std::sqrt(acceleration));
  const double ramp_s = rate / acceleration;
  const double ramp = 0.5 * rate * ramp_s;
  const double cruise_s = std::max(0.0, (1 - 2 * ramp) / rate);
  motion.phases[0] = {ramp_s, 0, 0, acceleration};
  motion.phases[1] = {cruise_s, ramp, rate, 0};
  motion.phases[2] = {ramp_s, 1 - ramp, rate, -acceleration};
  return motion;
}

JointMotion brake_on_path(const JointMotion& motion, Instant now,
                          const std::array<double, kJointsMax>& deceleration_rad_s2) {
  double s = 0, rate = 0;
  motion.path_at((now - motion.start).seconds(), s, rate);
  if (rate <= 0) return rest(now, motion.position_rad(now));
  // The joint that would take longest to stop sets the pace, so that all stay on the path.
  double time_s = 0;
  for (int j = 0; j < motion.direction_rad.size(); ++j) {
    const double speed_rad_s = std::abs(motion.direction_rad[j]) * rate;
    time_s = std::max(time_s, speed_rad_s / deceleration_rad_s2[static_cast<std::size_t>(j)]);
  }
  // It may already be slowing down; never stop later than it would have anyway.
  time_s = std::min(time_s, motion.duration_s() - (now - motion.start).seconds());
  JointMotion brake = motion;
  brake.start = now;
  brake.phases = {};
  brake.phases[0].s = s;
  brake.phases[2] = {time_s, s, rate, -rate / time_s};
  brake.final_s = s + 0.5 * rate * time_s;
  return brake;
}

}  // namespace firstlook::sim
