#include "algorithms/view_planning/thesis_views.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "algorithms/kinematics/numeric_inverse.hpp"
#include "algorithms/view_planning/ray_walk.hpp"

namespace firstlook {
namespace {

constexpr std::uint64_t kStream = 4600;    // of random numbers; + one for each choice
constexpr double kTargetMargin_m = 0.005;  // as ours: the next frame may take a little away from where the arm stands

struct ScoredPose {
  Transform<Base, Flange> base_T_flange;
  ThesisScore score;
};

/// Position on a sphere and orientation are drawn apart (figure 11-6).
Transform<Base, Flange> draw_pose(const ArmModel& arm, const ThesisOptions& options, Random& random) {
  const Eigen::Vector3d shoulder = arm.base_T_first * Eigen::Vector3d(0, 0, arm.dh[0].d_m);
  const double radius_m = random.uniform(options.radius_min_m, options.radius_max_m);
  const double polar = random.uniform(0, options.polar_max_rad);
  const double around = random.uniform(-std::numbers::pi, std::numbers::pi);
  const Eigen::Vector3d direction(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around),
                                  std::cos(polar));
  const double roll = random.uniform(-std::numbers::pi, std::numbers::pi);
  const double pitch = random.uniform(-std::numbers::pi, std::numbers::pi);
  const double yaw = random.uniform(-std::numbers::pi, std::numbers::pi);
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  return {turn, shoulder + radius_m * direction};
}

/// "Each point is then checked if it is not in an occupied or unknown area." What the safe zone holds is free.
bool lies_in_free_space(const ViewContext& context, const Eigen::Vector3d& point_m) {
  return context.space.margin_m(point_m, context.clearance) >= 0;
}

/// The nearest posture that brings the flange there and is free.
bool find_posture(const ViewContext& context, const Transform<Base, Flange>& base_T_flange, const JointVector& current,
                  JointVector& q_rad) {
  double nearest_rad = std::numeric_limits<double>::infinity();
  for (const JointVector& q : inverse_of(context.arm, base_T_flange, current)) {
    const double distance_rad = (q - current).max_abs();
    if (distance_rad >= nearest_rad) continue;
    if (!configuration_is_free(context.arm, context.body, context.space, context.clearance, q, kTargetMargin_m))
      continue;
    nearest_rad = distance_rad;
    q_rad = q;
  }
  return std::isfinite(nearest_rad);
}

}  // namespace

ThesisScore score_as_thesis(const ViewContext& context, const Transform<Base, Flange>& base_T_flange,
                            const Eigen::Vector3d& from_m, const ThesisOptions& options) {
  ThesisScore score;
  const Transform<Base, Depth> base_T_depth = base_T_flange * context.flange_T_depth;
  const Eigen::Vector3d eye = base_T_depth.translation();
  for (const Eigen::Vector3d& end : options.rays.ends_m) {
    walk_ray(context.map.geometry(), eye, base_T_depth * end, [&](std::size_t voxel, double) {
      const VoxelClass met = context.map.voxel_class(voxel);
      // Unknown space that the arm does not reach lies outside the thesis's virtual wall.
      if (met == VoxelClass::kFree || (met == VoxelClass::kUnknown && context.zone[voxel] == 0)) return true;
      if (met == VoxelClass::kUnknown) ++score.rays;
      return false;
    });
  }
  score.value =
      options.weight_per_ray * score.rays - options.weight_per_m * (base_T_flange.translation() - from_m).norm();
  return score;
}

Result<ViewChoice> choose_as_thesis(const ViewContext& context, const JointVector& current, Planner& planner,
                                    const ThesisOptions& options) {
  PlannerOptions planning;
  planning.seed = options.seed + options.step;
  planning.iterations_max = options.plan_iterations_max;
  planning.limits = options.limits;
  planning.trail = options.trail;
  if (Status begun = planner.begin(context.arm, context.body, context.space, context.clearance, current, planning);
      !begun) {
    return std::unexpected(begun.error());
  }
  Random random(options.seed, kStream + (std::uint64_t{options.step} << 20));
  const Eigen::Vector3d from_m = forward(context.arm, current).flange().translation();
  ViewChoice choice;
  std::vector<ScoredPose> poses;
  for (int round = 0; round < options.rounds_max; ++round) {
    poses.clear();
    for (int i = 0; i < options.candidates; ++i) {
      const Transform<Base, Flange> pose = draw_pose(context.arm, options, random);
      ++choice.considered;
      if (!lies_in_free_space(context, pose.translation())) continue;
      ++choice.free;
      const ThesisScore score = score_as_thesis(context, pose, from_m, options);
      if (score.rays >= options.rays_min) poses.push_back({pose, score});
    }
    choice.worthwhile += static_cast<int>(poses.size());
    std::ranges::stable_sort(poses, std::ranges::greater(), [](const ScoredPose& p) { return p.score.value; });
    for (const ScoredPose& pose : poses) {
      JointVector q;
      if (!find_posture(context, pose.base_T_flange, current, q)) continue;
      ++choice.planned;
      const Result<Path> path = planner.plan_to(q);
      if (!path) continue;
      choice.outcome = ViewChoice::Outcome::kChosen;
      choice.target = q;
      choice.path = *path;
      choice.gain.unknown = pose.score.rays;
      choice.utility_per_s = pose.score.value;
      return choice;
    }
  }
  choice.outcome = ViewChoice::Outcome::kComplete;
  choice.certificate.gain_min = options.rays_min;
  return choice;
}

}  // namespace firstlook
