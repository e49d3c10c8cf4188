/// FCL's octree collision checks and OMPL's RRTConnect on the cells that we plan in.
#pragma once

#include <memory>
#include <optional>

#include "tests/bench/motion_cells.hpp"

namespace firstlook::bench {

/// Capsules against the octree of all voxels that are not free, and against each other.
class CollisionPeer {
 public:
  virtual ~CollisionPeer() = default;
  /// Keeps the same distances as certificates do: the clearance less half a voxel diagonal, because the octree's
  /// voxels are cubes and ours their centres. What we call free must be free here.
  [[nodiscard]] virtual bool is_free(const JointVector& q_rad) const = 0;
};

/// FCL 0.7; null when it is not installed. The cell must outlive it.
[[nodiscard]] std::unique_ptr<CollisionPeer> make_fcl(const MotionCell& cell);

struct PeerPlan {
  bool solved = false;
  double seconds = 0;
};

/// OMPL's RRTConnect with default settings and one second. Without `checker` it checks states with our check and edges
/// with our certificate; with one it checks states of an edge every kPeerStep_rad. Empty when OMPL is not installed.
[[nodiscard]] std::optional<PeerPlan> plan_with_ompl(const MotionCell& cell, const CollisionPeer* checker,
                                                     const JointVector& start, const JointVector& goal);

/// Joint distance between two states that a peer checks along an edge.
inline constexpr double kPeerStep_rad = 0.03;

}  // namespace firstlook::bench
