/// One motion of a simulated controller as a function of time: movej, brake, or rest, and the ring-down after it.
#pragma once

#include <array>

#include "algorithms/kinematics/arm_model.hpp"
#include "platform/core/joint_vector.hpp"
#include "platform/core/time.hpp"

namespace firstlook::sim {

/// q(t) = origin + direction s(t) with s piecewise quadratic: constant acceleration in each phase.
struct JointMotion {
  struct Phase {
    double duration_s = 0;
    double s = 0;         ///< at its begin
    double rate_1_s = 0;  ///< at its begin
    double acceleration_1_s2 = 0;
  };

  Instant start{};
  JointVector origin_rad;
  JointVector direction_rad;
  std::array<Phase, 3> phases{};
  double final_s = 0;

  [[nodiscard]] double duration_s() const;
  [[nodiscard]] bool moving(Instant now) const;
  /// As commanded: what encoders read.
  [[nodiscard]] JointVector position_rad(Instant now) const;
  [[nodiscard]] JointVector velocity_rad_s(Instant now) const;
  /// With the structure's ring-down after the end of the motion.
  [[nodiscard]] JointVector true_position_rad(Instant now) const;

  /// Path parameter and its rate at a time after `start`.
  void path_at(double t_s, double& s, double& rate_1_s) const;
};

/// How far the structure swings beyond its rest, `after_s` after a motion that ended with these decelerations of the
/// joints (rad/s², positive along the motion).
[[nodiscard]] JointVector ring_down_rad(const JointVector& deceleration_rad_s2, double after_s);

/// Stands still.
[[nodiscard]] JointMotion rest(Instant start, const JointVector& at_rad);

/// movej without blend: the leading joint (longest way) runs a trapezoid, or a triangle when the way is short, of the
/// given speed and acceleration; all others are scaled to it. Positive speed and acceleration.
[[nodiscard]] JointMotion movej(Instant start, const JointVector& from_rad, const JointVector& to_rad,
                                double speed_rad_s, double acceleration_rad_s2);

/// Brakes on the path of `motion` from where it is at `now`, every joint within its own deceleration (rad/s²).
[[nodiscard]] JointMotion brake_on_path(const JointMotion& motion, Instant now,
                                        const std::array<double, kJointsMax>& deceleration_rad_s2);

}  // namespace firstlook::sim
