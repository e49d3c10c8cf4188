/// The first look around after calibration: the base turns in steps, then the wrist tilts (the thesis found that its
/// random views start badly from inside the safe zone). Whoever has better views than those stops it early.
#pragma once

#include "algorithms/motion/planner.hpp"
#include "algorithms/view_planning/base_turns.hpp"
#include "algorithms/view_planning/gain.hpp"

namespace firstlook {

struct SweepOptions {
  double step_share = 0.75;  ///< of the horizontal field of view: neighbours overlap, motion needs two looks
  double gain_min_m3 = 0.1;  ///< unknown volume; a step that sees less is left to the exploration
  int iterations_max = 300;  ///< of the planner for one step
  std::uint64_t seed = 1;
  SpeedLimits limits;  ///< for the path's duration
};

/// What has been done of a sweep. Plain data.
struct SweepProgress {
  Turns steps;
  FixedVector<std::uint8_t, kTurnsMax> done;  ///< taken, or not worth it any more
};

/// The steps around `start`: level, then tilted down and up by 30 degrees.
[[nodiscard]] SweepProgress plan_sweep(const ArmModel& arm, const JointVector& start, double horizontal_fov_rad,
                                       const SweepOptions& options = {});

struct SweepStep {
  bool done = false;  ///< true: no step left that is worth it and can be reached; the rest is meaningless
  JointVector target;
  Path path;  ///< from the current configuration, certified on the current free space
  ViewGain gain;
};

/// The next step in order that sees enough and can be reached now. Marks it, and every step that sees too little, in
/// `progress`; steps that cannot be reached yet stay and are tried again next time.
/// Errors: kStartBlocked when the current configuration is not free.
[[nodiscard]] Result<SweepStep> next_sweep_step(SweepProgress& progress, const ViewContext& context, GainModel& gain,
                                                GainWorker& worker, Planner& planner, const JointVector& current,
                                                const SweepOptions& options = {});

}  // namespace firstlook
