/// An arm with the joint axes that its factory measured.
#pragma once

#include <array>

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

/// What a factory's table is, and how far it is from the published one.
struct MeasuredArm {
  ArmModel arm;  ///< the same flange poses as the measured table gives, to rounding
  /// The largest distance and turn between a link's frame and the published one, all joints at 0.
  double frames_off_m = 0, frames_off_rad = 0;
};

/// The rows of `measured` (standard DH, as UR controllers tell them: theta, d, a, alpha) with frames that lie where the
/// published ones do, as near as the measured axes allow: the bodies of the links are told in them. Two axes that are
/// parallel but for some tenths of a milliradian have their common normal metres or hundreds of metres along them, and
/// the measured table has its frames there. A row with its second and third turn is any rigid motion, so nothing is
/// lost (Hayati and Mirmirani 1985). Of `published` all but the rows is kept.
[[nodiscard]] MeasuredArm with_factory_axes(const ArmModel& published, const std::array<DhRow, kJointsMax>& measured);

/// The same from frames in Base, all joints at 0: of each joint but the first one whose z is its axis, anywhere on it;
/// the flange is the last. Axis 1 is that of `published`.
using FactoryFrames = std::array<Pose, kJointsMax>;
[[nodiscard]] MeasuredArm with_factory_frames(const ArmModel& published, const FactoryFrames& measured);

}  // namespace firstlook
