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

/// Further views for a camera on an inner link, which the tilts of locate_views do not move: each joint between the
/// base joint and the one that tilts there is turned, both ways, the next joint with it where that gives the body more
/// room, and the base turns as there. (The base joint alone moves a camera on link 1: locate_views has looked all
/// around.) Certified as there; `start` itself is not among them. Empty when the arm has no such joints, or no room for
/// them.
[[nodiscard]] Turns locate_views_of_inner_links(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                                const Clearance& clearance, const JointVector& start,
                                                double horizontal_fov_rad);

}  // namespace firstlook
