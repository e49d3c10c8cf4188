/// Where to look for the board before anything is known.
#pragma once

#include "algorithms/motion/certificate.hpp"
#include "algorithms/view_planning/base_turns.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Configurations to look from, in order, the start itself first: the base turns monotonically within each round, later
/// rounds tilt the view up and down. Consecutive views overlap by 40 % of `horizontal_fov_rad`. Every straight move
/// from one to the next (the first from `start`) is certified; views that cannot be reached so are skipped. Errors:
/// kStartBlocked when `start` itself is not free.
[[nodiscard]] Result<Turns> locate_views(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                         const Clearance& clearance, const JointVector& start,
                                         double horizontal_fov_rad);

}  // namespace firstlook
