/// Closed-form inverse kinematics of the UR family.
#pragma once

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

inline constexpr std::size_t kInverseSolutionsMax = 8;
using InverseSolutions = FixedVector<JointVector, kInverseSolutionsMax>;

/// True for a six-joint arm of the UR family, its DH table within 10 mrad and 5 mm of that geometry, as it is after the
/// factory's correction of one arm: what `inverse` can solve.
[[nodiscard]] bool has_closed_form_inverse(const ArmModel& arm);

/// All joint angles (up to 8) that bring the flange to `base_T_flange`, each angle taken within the arm's limits as
/// near as possible to `reference`. Empty when out of reach. At a wrist singularity joint 6 keeps its reference angle.
/// The geometry is Hawkins 2013, "Analytic inverse kinematics for the Universal Robots"; each solution is polished by
/// Newton steps on the arm's own table until the pose agrees to better than 1e-9. With a corrected table, solutions
/// within some hundredths of a radian of a singularity may be missed. Programmer error when has_closed_form_inverse is
/// false.
[[nodiscard]] InverseSolutions inverse(const ArmModel& arm, const Transform<Base, Flange>& base_T_flange,
                                       const JointVector& reference_rad);

}  // namespace firstlook
