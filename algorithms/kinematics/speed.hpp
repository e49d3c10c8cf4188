/// How fast a joint-linear move may run so that no point of the body exceeds a Cartesian speed, and when it is where.
#pragma once

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

struct SpeedLimits {
  double body_speed_m_s = 0.25;            ///< of every point of the body (DESIGN rule 8)
  double joint_speed_rad_s = 1.05;         ///< of the leading joint; the arm's own limits hold besides
  double joint_acceleration_rad_s2 = 1.4;  ///< of the leading joint: 80 deg/s^2, mild for every UR arm
};

/// Upper bound of the speed of any point of the body along the segment, in metres for each unit of the path parameter
/// (0 at `from`, 1 at `to`). Proven: intervals are split until the bound is within 3 % of a speed that is reached.
[[nodiscard]] double speed_bound_m_per_unit(const ArmModel& arm, const Capsules& body, const JointVector& from,
                                            const JointVector& to);

/// One movej without blend: all joints follow one trapezoid, scaled to the leading joint as the UR controller does.
struct SegmentTiming {
  JointVector from;
  JointVector to;
  double leading_speed_rad_s = 0;          ///< argument v of movej
  double leading_acceleration_rad_s2 = 0;  ///< argument a of movej
  double leading_angle_rad = 0;            ///< largest joint displacement
  double duration_s = 0;
  double body_speed_bound_m_s = 0;  ///< no point of the body is faster

  /// Path parameter 0..1 at `t_s` seconds after the start; clamped outside [0, duration_s].
  [[nodiscard]] double fraction_at(double t_s) const;
  /// Its derivative, 1/s; 0 outside the move.
  [[nodiscard]] double fraction_rate_at(double t_s) const;
  [[nodiscard]] JointVector position_at(double t_s) const { return interpolate(from, to, fraction_at(t_s)); }
  [[nodiscard]] JointVector velocity_at(double t_s) const { return (to - from) * fraction_rate_at(t_s); }
};

/// The fastest movej from `from` to `to` within the limits. Equal ends give a duration of 0. Limits must be positive.
[[nodiscard]] SegmentTiming time_segment(const ArmModel& arm, const Capsules& body, const JointVector& from,
                                         const JointVector& to, const SpeedLimits& limits);
/// No more than time_segment's duration, at a fraction of its cost: by the speeds at both ends and half-way.
[[nodiscard]] double least_duration_s(const ArmModel& arm, const Capsules& body, const JointVector& from,
                                      const JointVector& to, const SpeedLimits& limits);

}  // namespace firstlook
