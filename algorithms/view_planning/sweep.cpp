#include "algorithms/view_planning/sweep.hpp"

#include <array>
#include <cmath>

namespace firstlook {
namespace {

constexpr double kTilt_rad = 30 * 0.017453292519943295;
constexpr std::array<double, 3> kTilts_rad{0, -kTilt_rad, kTilt_rad};

}  // namespace

SweepProgress plan_sweep(const ArmModel& arm, const JointVector& start, double horizontal_fov_rad,
                         const SweepOptions& options) {
  ENSURE(4521, horizontal_fov_rad > 0.1 && options.step_share > 0.1);
  SweepProgress progress;
  progress.steps = base_turns(arm, start, options.step_share * horizontal_fov_rad, kTilts_rad);
  progress.done.resize(progress.steps.size());
  return progress;
}

Result<SweepStep> next_sweep_step(SweepProgress& progress, const ViewContext& context, GainModel& gain,
                                  GainWorker& worker, Planner& planner, const JointVector& current,
                                  const SweepOptions& options) {
  PlannerOptions planning;
  planning.seed = options.seed;
  planning.iterations_max = options.iterations_max;
  planning.limits = options.limits;
  if (const Status begun =
          planner.begin(context.arm, context.body, context.space, context.clearance, current, planning);
      !begun) {
    return std::unexpected(begun.error());
  }
  gain.prepare(context);
  const double voxel_m3 = std::pow(context.map.geometry().resolution_m, 3);
  for (std::size_t i = 0; i < progress.steps.size(); ++i) {
    if (progress.done[i] != 0) continue;
    const JointVector& target = progress.steps[i];
    const ViewGain expected = gain.count(context, target, worker);
    if (expected.unknown * voxel_m3 < options.gain_min_m3) {
      progress.done[i] = 1;
      continue;
    }
    const Result<Path> path = planner.plan_to(target);
    if (!path) continue;
    progress.done[i] = 1;
    return SweepStep{.done = false, .target = target, .path = *path, .gain = expected};
  }
  return SweepStep{.done = true, .target = current, .path = {}, .gain = {}};
}

}  // namespace firstlook
