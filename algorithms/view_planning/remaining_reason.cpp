#include "algorithms/view_planning/remaining_reason.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "algorithms/view_planning/aim.hpp"
#include "algorithms/view_planning/ray_walk.hpp"

namespace firstlook {
namespace {

constexpr std::uint64_t kStream = 4700;      // of random numbers
constexpr double kFieldDistanceMax_m = 0.5;  // only whether a body fits matters, not how well
constexpr int kAimedTries = 16;              // directions from which each voxel is tried

/// Space and configurations as they could be at best: everything free that is not occupied, blocked or kept out.
struct Optimist {
  const ViewContext& context;
  const GainModel& gain;
  DistanceField field;
  FreeSpace space;
  double tan_x = 0;  ///< half the field of view
  double tan_y = 0;
  double range_min_m = 0;
  double range_max_m = 0;
  std::vector<Transform<Base, Depth>> views;  ///< random configurations that fit there

  Optimist(const ViewContext& c, const GainModel& g)
      : context(c), gain(g), field(c.map.geometry(), kFieldDistanceMax_m), space(c.space) {
    std::vector<std::uint8_t> not_occupied(c.map.size());
    for (std::size_t i = 0; i < not_occupied.size(); ++i) {
      not_occupied[i] = c.map.voxel_class(i) != VoxelClass::kOccupied && !c.map.blocked(i) ? 1 : 0;
    }
    field.update(not_occupied);
    space.field = &field;
    const DepthSensor& sensor = gain.sensor();
    tan_x = sensor.intrinsics.width / (2 * sensor.intrinsics.fx);
    tan_y = sensor.intrinsics.height / (2 * sensor.intrinsics.fy);
    range_min_m = sensor.range_min_m;
    range_max_m = std::min(sensor.range_max_m, sensor.range_trusted_m);
  }
  [[nodiscard]] bool fits(const JointVector& q) const {
    return configuration_is_free(context.arm, context.body, space, context.clearance, q);
  }
};

/// What a look at a point meets.
enum class Sight : std::uint8_t { kNone, kNoReturn, kBadRange, kGood };

/// Whether nothing occupied stands between a place and a voxel; unknown voxels are taken to be transparent.
bool in_sight(const VoxelMap& map, const Eigen::Vector3d& eye, const Eigen::Vector3d& point, std::size_t voxel) {
  bool open = true;
  walk_ray(map.geometry(), eye, point, [&](std::size_t i, double) {
    open = i == voxel || map.voxel_class(i) != VoxelClass::kOccupied;
    return open && i != voxel;
  });
  return open;
}

Sight sight(const Optimist& o, const Transform<Base, Depth>& base_T_depth, const Eigen::Vector3d& point,
            std::size_t voxel) {
  const Eigen::Vector3d p = base_T_depth.inverse() * point;
  if (p.z() <= 0 || std::abs(p.x()) > o.tan_x * p.z() || std::abs(p.y()) > o.tan_y * p.z()) return Sight::kNone;
  if (!in_sight(o.context.map, base_T_depth.translation(), point, voxel)) return Sight::kNone;
  if (p.z() < o.range_min_m || p.norm() > o.range_max_m) return Sight::kBadRange;
  const Eigen::Vector3d eye = base_T_depth.translation();
  return o.gain.is_open(eye, (point - eye).normalized()) ? Sight::kNoReturn : Sight::kGood;
}

void sample_views(Optimist& o, const ReasonOptions& options, Random& random) {
  const ArmModel& arm = o.context.arm;
  for (int tries = 0; tries < 40 * options.configurations && std::ssize(o.views) < options.configurations; ++tries) {
    JointVector q = JointVector::zero(arm.joints);
    for (int j = 0; j < arm.joints; ++j) {
      const auto i = static_cast<std::size_t>(j);
      q[j] =
          random.uniform(std::max(arm.lower_rad[i], -std::numbers::pi), std::min(arm.upper_rad[i], std::numbers::pi));
    }
    if (o.fits(q)) o.views.push_back(forward(arm, q).flange() * o.context.flange_T_depth);
  }
}

/// The best sight that poses aimed at the voxel give.
Sight aimed_sight(const Optimist& o, const Eigen::Vector3d& point, std::size_t voxel, Random& random) {
  const JointVector reference = JointVector::zero(o.context.arm.joints);
  Sight best = Sight::kNone;
  for (int i = 0; i < kAimedTries && best != Sight::kGood; ++i) {
    const double distance_m = random.uniform(0.6 * o.range_min_m, std::min(1.5, o.range_max_m));
    const auto base_T_depth =
        look_at<Depth>(point, random.direction(), distance_m, random.uniform(0, 2 * std::numbers::pi));
    const Sight seen = sight(o, base_T_depth, point, voxel);
    if (seen <= best) continue;
    const InverseSolutions solutions =
        postures_looking(o.context.arm, base_T_depth, o.context.flange_T_depth.inverse(), distance_m, reference);
    for (const JointVector& q : solutions) {
      if (!o.fits(q)) continue;
      // With few joints the sensor ends elsewhere than asked.
      const Sight there = o.context.arm.joints < 6
                              ? sight(o, forward(o.context.arm, q).flange() * o.context.flange_T_depth, point, voxel)
                              : seen;
      best = std::max(best, there);
    }
  }
  return best;
}

RemainingReason reason_of(const Optimist& o, std::uint32_t voxel, Random& random) {
  const GainModel& gain = o.gain;
  if (gain.futile().count(voxel) >= gain.sampling().futile_max) return RemainingReason::kNoReturn;
  const GridGeometry& geometry = o.context.map.geometry();
  const Eigen::Vector3d point = geometry.center_m(geometry.voxel_at(voxel));
  Sight best = Sight::kNone;
  for (const auto& view : o.views) {
    best = std::max(best, sight(o, view, point, voxel));
    if (best == Sight::kGood) break;
  }
  if (best != Sight::kGood) best = std::max(best, aimed_sight(o, point, voxel, random));
  switch (best) {
    case Sight::kGood:
      return RemainingReason::kOutOfReach;
    case Sight::kBadRange:
      return RemainingReason::kOutOfRange;
    case Sight::kNoReturn:
      return RemainingReason::kNoReturn;
    case Sight::kNone:
      break;
  }
  return RemainingReason::kOccluded;
}

}  // namespace

std::string_view to_string(RemainingReason reason) {
  switch (reason) {
    case RemainingReason::kOccluded:
      return "occluded";
    case RemainingReason::kOutOfRange:
      return "out_of_range";
    case RemainingReason::kOutOfReach:
      return "out_of_reach";
    case RemainingReason::kNoReturn:
      return "no_return";
  }
  return "occluded";
}

std::vector<RemainingEntry> explain_remaining(const ViewContext& context, const GainModel& gain,
                                              std::span<const UnknownCluster> clusters, const ReasonOptions& options) {
  Optimist optimist(context, gain);
  Random random(options.seed, kStream);
  sample_views(optimist, options, random);
  std::vector<RemainingEntry> entries;
  entries.reserve(clusters.size());
  for (const UnknownCluster& cluster : clusters) {
    std::array<int, 4> votes{};
    const std::size_t n = std::min(cluster.frontier.size(), static_cast<std::size_t>(options.voxels_per_cluster));
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint32_t voxel = cluster.frontier[i * cluster.frontier.size() / n];
      ++votes[static_cast<std::size_t>(reason_of(optimist, voxel, random))];
    }
    const auto winner = std::max_element(votes.begin(), votes.end()) - votes.begin();
    entries.push_back({.voxels = cluster.voxels,
                       .center_m = cluster.center_m,
                       .box = cluster.box,
                       .reason = static_cast<RemainingReason>(winner)});
  }
  return entries;
}

}  // namespace firstlook
