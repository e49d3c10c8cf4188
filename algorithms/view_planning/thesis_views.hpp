/// The views of the thesis that firstlook comes from, as a baseline to measure against: few random poses, best first.
#pragma once

#include <cstdint>

#include "algorithms/mapping/ray_cast.hpp"
#include "algorithms/motion/planner.hpp"
#include "algorithms/view_planning/explore.hpp"

namespace firstlook {

/// Chapter 11 of the thesis states the first part and leaves the second open: there stand the values that are best for
/// it, all but rounds_max tried over six cells that no comparison uses (`firstlook_bench --only thesis_tuning`: 227 s
/// to 95 % of what can be observed, 339 s with what was guessed before). The sweep before and the checks of every path
/// are ours. Frames on the way are not used (the thesis's sensor was off while a map was loaded), and rays meet unknown
/// space within reach alone, as in the thesis's virtual wall.
struct ThesisOptions {
  std::uint64_t seed = 1;
  std::uint32_t step = 0;  ///< number of this choice: other poses each time
  int candidates = 20;     ///< poses of one round
  GainRays rays = GainRays::thesis();

  double radius_min_m = 0.5;                ///< of the sphere about the shoulder on which the end effector lies
  double radius_max_m = 0.7;                ///< a UR5 reaches 0.9
  double polar_max_rad = 1.8;               ///< from straight up; farther down there is the cart
  double weight_per_ray = 1;                ///< of gain
  double weight_per_m = 150;                ///< of the way there, as a straight line
  int rounds_max = 40;                      ///< of new poses when all fail: then it ends; the thesis has no rule
  std::uint32_t rays_min = 40;              ///< that must meet unknown space: 10 to 400 come to the same
  int plan_iterations_max = 400;            ///< of the planner, for one pose
  SpeedLimits limits;                       ///< for the path's duration
  std::span<const JointVector> trail = {};  ///< PlannerOptions::trail
};

/// What a pose is worth, as the thesis counts it.
struct ThesisScore {
  std::uint32_t rays = 0;  ///< that end in unknown space within reach; the arm is taken to hide nothing
  double value = 0;        ///< weighted rays less weighted way
};
[[nodiscard]] ThesisScore score_as_thesis(const ViewContext& context, const Transform<Base, Flange>& base_T_flange,
                                          const Eigen::Vector3d& from_m, const ThesisOptions& options);

/// The next view. ViewChoice::gain.unknown is the number of rays, utility_per_s the value. kComplete: `rounds_max`
/// rounds brought no pose that is free, worth it and reached by a certified path. Errors: kStartBlocked when `current`
/// is not free. For arms with a closed-form inverse.
[[nodiscard]] Result<ViewChoice> choose_as_thesis(const ViewContext& context, const JointVector& current,
                                                  Planner& planner, const ThesisOptions& options);

}  // namespace firstlook
