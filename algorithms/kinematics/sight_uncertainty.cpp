#include "algorithms/kinematics/sight_uncertainty.hpp"

#include <cmath>

#include "algorithms/kinematics/twist.hpp"

namespace firstlook {

double sight_sigma_m(const LinkFrames& frames, const Eigen::Vector3d& flange_p_point, const MotionAtStamp& motion) {
  constexpr double kStands_rad_s = 1e-4;  // ten times the encoders' resolution between two reports
  if (motion.velocity_rad_s.max_abs() < kStands_rad_s) return 0;
  const int flange = motion.velocity_rad_s.size();
  const Eigen::Vector3d point_m = frames.flange().pose() * flange_p_point;
  const double speed_m_s = link_twists(frames, motion.velocity_rad_s).velocity(flange, point_m).norm();
  const double error_rad = motion.acceleration_max_rad_s2 * motion.reports_apart_s * motion.reports_apart_s / 8;
  double interpolation_m = 0;
  for (int joint = 0; joint < flange; ++joint) {
    JointVector one = JointVector::zero(flange);
    one[joint] = 1;
    interpolation_m += error_rad * link_twists(frames, one).velocity(flange, point_m).norm();
  }
  return std::hypot(speed_m_s * motion.stamp_sigma_s, interpolation_m);
}

}  // namespace firstlook
