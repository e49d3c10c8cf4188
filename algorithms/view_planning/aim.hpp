/// Where the flange must be for a sensor on it to look at a point.
#pragma once

#include <cmath>

#include "algorithms/kinematics/numeric_inverse.hpp"
#include "platform/core/random.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

/// The pose of a sensor that looks at `target_m` from `distance_m` away in unit direction `outward` (from the target to
/// the sensor), turned by `roll_rad` about its optical axis.
template <typename Sensor>
[[nodiscard]] Transform<Base, Sensor> look_at(const Eigen::Vector3d& target_m, const Eigen::Vector3d& outward,
                                              double distance_m, double roll_rad) {
  const Eigen::Vector3d z = -outward;
  const Eigen::Vector3d x = z.unitOrthogonal();
  Pose pose = Pose::Identity();
  pose.linear().col(0) = x;
  pose.linear().col(1) = z.cross(x);
  pose.linear().col(2) = z;
  pose.linear() = pose.linear() * Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = target_m + outward * distance_m;
  return Transform<Base, Sensor>(pose);
}

/// A unit vector within `angle_rad` of the unit vector `axis`, uniform over that cap of the sphere.
[[nodiscard]] inline Eigen::Vector3d direction_within(const Eigen::Vector3d& axis, double angle_rad, Random& random) {
  const double c = random.uniform(std::cos(angle_rad), 1.0);
  const double s = std::sqrt(std::max(0.0, 1 - c * c));
  const double turn = random.uniform(0, 6.283185307179586);
  const Eigen::Vector3d u = axis.unitOrthogonal();
  return c * axis + s * (std::cos(turn) * u + std::sin(turn) * axis.cross(u));
}

/// Postures for a sensor on the flange to look at the point `distance_m` ahead of `base_T_sensor`: those of the very
/// pose, or with fewer than six joints those that come nearest to it (inverse_looking). `sensor_T_flange` is its mount.
template <typename Sensor>
[[nodiscard]] InverseSolutions postures_looking(const ArmModel& arm, const Transform<Base, Sensor>& base_T_sensor,
                                                const Transform<Sensor, Flange>& sensor_T_flange, double distance_m,
                                                const JointVector& reference_rad) {
  if (has_closed_form_inverse(arm)) return inverse(arm, base_T_sensor * sensor_T_flange, reference_rad);
  return inverse_looking(arm, sensor_T_flange.pose().inverse(Eigen::Isometry), base_T_sensor.pose(), distance_m,
                         reference_rad);
}

}  // namespace firstlook
