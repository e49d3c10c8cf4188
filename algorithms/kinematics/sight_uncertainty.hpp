/// How well it is known where a moving camera looked when its frame was taken.
#pragma once

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

/// What is known of the arm around a frame's stamp.
struct MotionAtStamp {
  JointVector velocity_rad_s;            ///< between the reports before and after it
  double reports_apart_s = 0;            ///< of these two
  double stamp_sigma_s = 0;              ///< standard deviation of the stamp against the arm's time
  double acceleration_max_rad_s2 = 1.4;  ///< of any joint while it moves
};

/// Standard deviation (m) of a point that hangs on the flange and was placed by joints interpolated linearly at the
/// stamp: its speed times the stamp's sigma, and together with it the interpolation's largest error, an eighth of
/// acceleration times the square of the time between reports, for every joint. 0 for an arm that stands.
/// @param frames  forward() of the interpolated joints
[[nodiscard]] double sight_sigma_m(const LinkFrames& frames, const Eigen::Vector3d& flange_p_point,
                                   const MotionAtStamp& motion);

}  // namespace firstlook
