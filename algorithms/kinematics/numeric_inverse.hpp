/// Inverse kinematics of any chain: damped least squares from many starts.
#pragma once

#include "algorithms/kinematics/inverse_kinematics.hpp"

namespace firstlook {

struct NumericInverseOptions {
  int starts_max = 24;      ///< the reference first, then random postures
  int iterations_max = 60;  ///< of one start
  int solutions_max = 8;    ///< enough; at most kInverseSolutionsMax
  std::uint64_t seed = 1;
};

/// Joint angles within the limits that bring the flange to `base_T_flange` to better than 1e-9, as near to `reference`
/// as whole turns allow, in the order in which they were found; those that differ by less than 0.05 rad count once.
/// Levenberg-Marquardt steps (Sugihara 2011, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt
/// method"), bounded, no allocation; the same arguments give the same bytes. An arm with fewer than six joints reaches
/// few poses, one with seven each in endless ways of which some come out. Empty: none was found, which is no proof that
/// there is none. A start takes some 10 us.
[[nodiscard]] InverseSolutions inverse_numeric(const ArmModel& arm, const Transform<Base, Flange>& base_T_flange,
                                               const JointVector& reference_rad,
                                               const NumericInverseOptions& options = {});

/// The closed form where the arm has one, otherwise numeric: what callers use that know the arm only as data.
[[nodiscard]] InverseSolutions inverse_of(const ArmModel& arm, const Transform<Base, Flange>& base_T_flange,
                                          const JointVector& reference_rad);

/// Joint angles for a sensor on the flange to look at the point `distance_m` ahead of `base_T_sensor` along its z. With
/// six joints or more: from that very pose. With fewer: with the point on the sensor's axis to 0.01 rad, from as near
/// to that place as the arm gets; the roll is as it comes. Callers look at where the sensor ended.
[[nodiscard]] InverseSolutions inverse_looking(const ArmModel& arm, const Pose& flange_T_sensor,
                                               const Pose& base_T_sensor, double distance_m,
                                               const JointVector& reference_rad);

}  // namespace firstlook
