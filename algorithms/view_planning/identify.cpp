#include "algorithms/view_planning/identify.hpp"

#include <utility>

namespace firstlook {
namespace {

/// Joint `joint` turned by +size and -size, as far as they can be certified; the one that proves more margin first.
FixedVector<JointVector, 2> turned(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                   const Clearance& clearance, const JointVector& at, int joint, double size_rad) {
  FixedVector<JointVector, 2> turns;
  double first_margin_m = 0;
  for (const double sign : {1.0, -1.0}) {
    JointVector q = at;
    q[joint] += sign * size_rad;
    if (!certify(arm, body, space, clearance, at, q).certified()) continue;
    const double margin_m = configuration_margin(arm, body, space, clearance, q);
    turns.push_back(q);
    if (turns.size() == 2 && margin_m > first_margin_m + 1e-9) std::swap(turns[0], turns[1]);
    first_margin_m = margin_m;
  }
  return turns;
}

}  // namespace

Result<Turns> identify_motions(const ArmModel& arm, const Body& body, const FreeSpace& space,
                               const Clearance& clearance, const JointVector& at, const IdentifyOptions& options) {
  const double margin_m = configuration_margin(arm, body, space, clearance, at);
  if (margin_m < kMarginMin_m) {
    return failure(Fault::kStartBlocked, "the arm lacks {:.0f} mm of clearance", (kMarginMin_m - margin_m) * 1e3);
  }
  Turns motions;
  for (int joint = arm.joints - 1; joint >= 0; --joint) {
    const double size_rad = joint == arm.joints - 1 ? options.last_joint_rad : options.other_joints_rad;
    auto turns = turned(arm, body, space, clearance, at, joint, size_rad);
    if (turns.empty()) turns = turned(arm, body, space, clearance, at, joint, size_rad / 2);
    for (const JointVector& q : turns) motions.push_back(q);
  }
  if (motions.empty()) return failure(Fault::kNothingReachable, "no joint can be moved inside the safe zone");
  return motions;
}

}  // namespace firstlook
