/// Distances between capsules of one body.
#pragma once

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

/// Distance between two line segments; 0 when they cross. Ericson 2005, "Real-time collision detection", 5.1.9.
[[nodiscard]] double segment_distance_m(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                                        const Eigen::Vector3d& b1);

/// Distance between the surfaces of two capsules in the same frame; negative when they overlap.
[[nodiscard]] double capsule_distance_m(const Capsule& a, const Capsule& b);

/// Two capsules (indices into a body) whose axes must stay `axes_apart_m` or more from each other.
struct SelfPair {
  int near = 0;  ///< on the link nearer to the base
  int far = 0;
  double axes_apart_m = 0;
};
inline constexpr std::size_t kSelfPairsMax = 128;
using SelfPairs = FixedVector<SelfPair, kSelfPairsMax>;

/// The pairs of an arm's own capsules that can meet: links three or more apart, and 1-3 and 2-4. Neighbours touch by
/// construction, so do 3-5 and 4-6 at the wrist; the upper arm passes beside the base (0-2) at every angle.
/// The body's padding is left out: it stands for what is not known about the surroundings, and with it the wrist could
/// not turn past the forearm.
[[nodiscard]] SelfPairs self_pairs_of_arm(const Capsules& arm_body, double clearance_m);

/// The pairs of any arm: those that it lists itself, or for a UR as above.
[[nodiscard]] SelfPairs self_pairs_of_arm(const ArmModel& arm, double clearance_m);

/// Smallest distance beyond what the pairs require; negative: self collision. +infinity without pairs.
[[nodiscard]] double self_margin_m(const Capsules& placed, const SelfPairs& pairs);

}  // namespace firstlook
