/// Certified paths between configurations: bidirectional RRT (Kuffner and LaValle 2000), then shortcuts.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/kinematics/speed.hpp"
#include "algorithms/motion/certificate.hpp"
#include "platform/core/random.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

inline constexpr std::size_t kWaypointsMax = 32;

/// Joint-linear segments between consecutive waypoints, each certified.
struct Path {
  FixedVector<JointVector, kWaypointsMax> waypoints;  ///< start first, goal last
  double length_rad = 0;                              ///< sum of the leading joint's angle over the segments
  double duration_s = 0;                              ///< each segment starts and ends at rest
  double margin_m = 0;                                ///< proven for the whole path
};

struct PlannerOptions {
  std::uint64_t seed = 1;
  int iterations_max = 2000;  ///< random samples for one goal
  int shortcuts_max = 40;     ///< attempts
  double step_m = 0.35;       ///< longest edge, in joint distance weighted by lever arm
  SpeedLimits limits = {};    ///< for duration_s
  /// Configurations by which the arm came here, the latest last; read by begin() only. Those that can still be reached
  /// along them are there before the first sample: what was passed on the way out is the way back.
  std::span<const JointVector> trail = {};
};

/// Plans from one start to one or several goals. Holds the nodes; does not allocate after construction.
class Planner {
 public:
  /// Room for `nodes_max` configurations in each of the two trees.
  explicit Planner(int nodes_max = 4000);
  /// What such a planner reserves.
  [[nodiscard]] static std::size_t required_bytes(int nodes_max = 4000);

  /// A certified path. The same arguments give the same path. Errors: kStartBlocked (the start is not free),
  /// kNoPath (the goal is not free or outside the limits, or no connection was found; the detail says which and where).
  [[nodiscard]] Result<Path> plan(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                  const Clearance& clearance, const JointVector& start, const JointVector& goal,
                                  const PlannerOptions& options = {});

  /// For several goals from one start: plans as `plan` does, but starts with the tree that the goals before it left.
  /// `begin` sets start and surroundings (which must outlive the calls of `plan_to`); kStartBlocked as above.
  [[nodiscard]] Status begin(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                             const JointVector& start, const PlannerOptions& options = {});
  [[nodiscard]] Result<Path> plan_to(const JointVector& goal);

 private:
  struct Node {
    JointVector q;
    int parent = -1;
  };
  using Tree = std::vector<Node>;  // reserved at construction, never beyond

  [[nodiscard]] int nearest(const Tree& tree, const JointVector& q) const;
  [[nodiscard]] int extend(Tree& tree, int from, const JointVector& towards) const;
  [[nodiscard]] int connect(Tree& tree, const JointVector& target) const;
  void follow_trail();
  [[nodiscard]] JointVector sample(const JointVector& goal);
  [[nodiscard]] bool search(const JointVector& goal);
  void collect(int start_leaf, int goal_leaf);
  void skip_waypoints();
  void cut_corners();
  [[nodiscard]] Result<Path> finish() const;
  [[nodiscard]] Certificate check(const JointVector& from, const JointVector& to) const;
  [[nodiscard]] double distance_m(const JointVector& a, const JointVector& b) const;

  std::size_t nodes_max_;
  Tree from_start_;
  std::size_t trail_nodes_ = 1;  ///< of from_start_: the start and the trail
  Tree from_goal_;
  std::vector<JointVector> chain_;  // the path found, start first
  const ArmModel* arm_ = nullptr;
  const Body* body_ = nullptr;
  FreeSpace space_;
  Clearance clearance_;
  PlannerOptions options_;
  JointVector start_;
  Random random_{0};
  std::array<double, kJointsMax> weight_m_{};
};

}  // namespace firstlook
