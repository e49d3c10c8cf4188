/// Closed-form inverse kinematics of the UR family.
#pragma once

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

inline constexpr std::size_t kInverseSolutionsMax = 8;
using InverseSolutions = FixedVector<JointVector, kInverseSolutionsMax>;

/// True for a six-joint arm with the twists of the UR family and no theta offsets: what `inverse` can solve.
[[nodiscard]] bool has_closed_form_inverse(const ArmModel& arm);

/// All joint angles (up to 8) that bring the flange to `base_T_flange`, each angle taken within the arm's limits as
/// near as possible to `reference`. Empty when out of reach. At a wrist singularity joint 6 keeps its reference angle.
/// The geometry is Hawkins 2013, "Analytic inverse kinematics for the Universal Robots"; each solution is polished by
/// Newton steps until the pose agrees to better than 1e-9. Programmer error when has_closed_form_inverse is false.
[[nodiscard]] InverseSolutions inverse(const ArmModel& arm, const Transform<Base, Flange>& base_T_flange,
                                       const JointVector& reference_rad);

}  // namespace firstlook
