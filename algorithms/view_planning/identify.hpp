/// Small test motions that tell which link carries the camera.
#pragma once

#include "algorithms/motion/certificate.hpp"
#include "algorithms/view_planning/base_turns.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

struct IdentifyOptions {
  double last_joint_rad = 0.14;    ///< 8 degrees: the last joint rolls the image about its own axis
  double other_joints_rad = 0.09;  ///< 5 degrees: they sweep the view, and the board should stay in it
};

/// Up to two configurations for each joint, the outermost first, that differ from `at` in that joint alone: by the size
/// above, or half of it, to either side, the one with more margin first. A board at the picture's edge leaves the view
/// on one of them. Straight moves there and back are certified; a joint that cannot be moved is left out. Errors:
/// kStartBlocked when `at` is not free, kNothingReachable when no joint can be moved.
[[nodiscard]] Result<Turns> identify_motions(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                             const Clearance& clearance, const JointVector& at,
                                             const IdentifyOptions& options = {});

}  // namespace firstlook
