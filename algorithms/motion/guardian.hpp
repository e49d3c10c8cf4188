/// The second opinion: looks at where the arm is, never at how its path was planned.
#pragma once

#include <cstdint>
#include <optional>

#include "algorithms/motion/body.hpp"
#include "algorithms/motion/free_space.hpp"

namespace firstlook {

enum class GuardianFinding : std::uint8_t { kFine, kDeviation, kNotFree };

struct GuardianVerdict {
  GuardianFinding finding = GuardianFinding::kFine;
  double deviation_m = 0;    ///< largest displacement of any body point from the path; 0 without a path
  double path_fraction = 0;  ///< of the nearest point of the path
  double margin_m = 0;       ///< smallest over the sampled surface points, beyond the required clearance
  /// Smallest distance of the sampled surface points to what is not free: half a voxel diagonal less than to the centre
  /// of a voxel, so that no corner of it is nearer. Negative inside.
  double distance_m = 0;
  int capsule = -1;  ///< where the margin is smallest
  [[nodiscard]] bool fine() const { return finding == GuardianFinding::kFine; }
};

/// The segment that the arm was told to follow.
struct GuardianPath {
  JointVector from;
  JointVector to;
};

/// Checks one arm state against the path (when it has one) and the map. Deviation is geometric, never a matter of time.
/// `clearance` is what must remain in motion: smaller than the planner's, which contains the stopping distance.
/// Surface points of all capsules are sampled every `spacing_m`; some 20 us.
[[nodiscard]] GuardianVerdict check(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                    const Clearance& clearance, const JointVector& q_rad,
                                    const std::optional<GuardianPath>& path, double deviation_max_m = 0.01,
                                    double spacing_m = 0.025);

/// What must remain between body and voxel centres while the guardian watches, given the planner's clearance: the
/// planner's without the stopping distance, which is there to be used up.
[[nodiscard]] Clearance guardian_clearance(const Clearance& planned, double stopping_m);

}  // namespace firstlook
