/// Configurations that turn one posture around the base, and tilt its view up and down.
#pragma once

#include <span>

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

inline constexpr std::size_t kTurnsMax = 64;
using Turns = FixedVector<JointVector, kTurnsMax>;

/// The joint, outermost but one or inwards, whose axis stands most nearly across the flange's z axis and level: turning
/// it tilts the view (wrist 1 of a UR arm). `up_sign` is the sign that raises the flange's z axis.
struct TiltJoint {
  int joint = 0;
  double up_sign = 1;
};
[[nodiscard]] TiltJoint tilt_joint(const ArmModel& arm, const JointVector& q_rad);

/// One round for each posture: the base joint covers 360 degrees, or what its limits allow, in equal steps of at most
/// `step_rad`. The first round begins at the first posture when the limits leave a full turn to one side of it, else at
/// the limit next to it. Odd rounds run backwards, so the base never winds up and never travels far between rounds. Cut
/// at kTurnsMax.
[[nodiscard]] Turns base_rounds(const ArmModel& arm, std::span<const JointVector> postures, double step_rad);

/// The rounds of `start` with its view tilted up and down: one for each tilt (rad, up positive, added to that of
/// `start`). Tilts beyond the joint's limits are left out.
[[nodiscard]] Turns base_turns(const ArmModel& arm, const JointVector& start, double step_rad,
                               std::span<const double> tilts_rad);

}  // namespace firstlook
