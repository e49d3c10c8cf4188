#include "algorithms/view_planning/gain.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/view_planning/ray_walk.hpp"

namespace firstlook {
namespace {

// Weights in the plane that tell the two kinds of voxels apart in one sum: unknown = (weight - voxels) / 3.
constexpr std::uint8_t kUnknownWeight = 4;
constexpr std::uint8_t kAgainWeight = 1;
constexpr std::uint8_t kPass = 0;

/// Free in the map, but motion cannot use it: seen from one pose only, in part (but not beside a surface), doubted by
/// the latest frame, or so long ago that it soon cannot.
bool needs_again(const ViewContext& context, std::size_t index) {
  if (context.space.field == nullptr || context.map.voxel_class(index) != VoxelClass::kFree) return false;
  if (context.map.blocked(index) || context.map.holds_surface(index)) return false;
  return context.space.field->values()[index] <= 0 ||
         context.map.expires(index, context.fresh_until_s, context.free_max_age_s);
}

/// Whether a capsule in base coordinates can come between the sensor and any of its rays: it is not the sensor's own
/// housing, and its bounding sphere meets the cone of the field of view.
bool may_block(const Capsule& capsule, const Eigen::Vector3d& eye, const Eigen::Vector3d& optical_axis,
               double half_cone_rad) {
  if (segment_distance_m(eye, eye, capsule.a, capsule.b) <= capsule.radius_m) return false;
  const Eigen::Vector3d to_center = (capsule.a + capsule.b) / 2 - eye;
  const double radius_m = (capsule.b - capsule.a).norm() / 2 + capsule.radius_m;
  const double distance_m = to_center.norm();
  if (distance_m <= radius_m) return true;
  const double angle = std::acos(std::clamp(to_center.dot(optical_axis) / distance_m, -1.0, 1.0));
  return angle - std::asin(radius_m / distance_m) <= half_cone_rad;
}

}  // namespace

GainWorker::GainWorker(const GridGeometry& geometry, std::size_t rays_max) : scratch(geometry) {
  rays.ends_m.reserve(rays_max);
}

GainModel::GainModel(const GridGeometry& geometry, const DepthSensor& sensor, const GainSampling& sampling)
    : geometry_(geometry),
      sensor_(sensor),
      sampling_(sampling),
      rays_(GainRays::pinhole(sensor.intrinsics, sampling.columns, sampling.rows,
                              std::min(sensor.range_max_m, sensor.range_trusted_m))),
      plane_(geometry),
      futile_(geometry) {
  frontier_.reserve(geometry.count());
  for (const Eigen::Vector3d& end : rays_.ends_m) {
    half_cone_rad_ = std::max(half_cone_rad_, std::acos(std::clamp(end.z() / end.norm(), -1.0, 1.0)));
  }
}

std::size_t GainModel::required_bytes(const GridGeometry& geometry, const GainSampling& sampling) {
  const auto rays = static_cast<std::size_t>(sampling.columns) * static_cast<std::size_t>(sampling.rows);
  return GainPlane::required_bytes(geometry) + geometry.count() * (sizeof(std::uint8_t) + sizeof(std::uint32_t)) +
         rays * sizeof(Eigen::Vector3d);
}

void GainModel::prepare(const ViewContext& context) {
  ENSURE(4511, context.map.geometry() == geometry_);
  ENSURE(4512, context.zone.size() == geometry_.count());
  unknown_ = 0;
  const std::span<std::uint8_t> plane = plane_.what();
  for (std::size_t i = 0; i < plane.size(); ++i) {
    const bool counts = context.zone[i] != 0;
    const bool futile = futile_.count(i) >= sampling_.futile_max;
    switch (context.map.voxel_class(i)) {
      case VoxelClass::kOccupied:
        plane[i] = kOpaque;
        break;
      case VoxelClass::kUnknown:
        plane[i] = futile ? kOpaque : counts ? kUnknownWeight : kUnknownNoWeight;
        unknown_ += counts ? 1 : 0;
        break;
      case VoxelClass::kFree:
        plane[i] = counts && !futile && needs_again(context, i) ? kAgainWeight : kPass;
        break;
    }
  }
  plane_.prepare(UnknownReading::kSeeThrough);
  find_frontier(context);
  if (context.prior != nullptr) prepare_prior(context);
}

void GainModel::prepare_prior(const ViewContext& context) {
  ENSURE(4513, prior_plane_ && context.prior->geometry() == geometry_);
  const std::span<const std::uint8_t> what = plane_.what();
  const std::span<std::uint8_t> prior = prior_plane_->what();
  for (std::size_t i = 0; i < what.size(); ++i) {
    const bool expected = what[i] == kUnknownWeight && context.prior->voxel_class(i) == VoxelClass::kOccupied;
    prior[i] = what[i] == kOpaque ? kOpaque : expected ? std::uint8_t{1} : kPass;
  }
  prior_plane_->prepare(UnknownReading::kSeeThrough);
}

void GainModel::find_frontier(const ViewContext& context) {
  frontier_.clear();
  for (std::size_t i = 0; i < geometry_.count(); ++i) {
    if (plane_.what()[i] != kUnknownWeight) continue;
    const Eigen::Vector3i v = geometry_.voxel_at(i);
    for (int side = 0; side < 6; ++side) {
      Eigen::Vector3i n = v;
      n[side / 2] += side % 2 == 0 ? 1 : -1;
      if (geometry_.contains(n) && context.map.voxel_class(geometry_.index(n)) == VoxelClass::kFree) {
        frontier_.push_back(static_cast<std::uint32_t>(i));
        break;
      }
    }
  }
}

const GainRays& GainModel::free_rays(const ViewContext& context, const LinkFrames& frames,
                                     const Transform<Base, Depth>& base_T_depth, GainWorker& worker) const {
  const Eigen::Vector3d eye = base_T_depth.translation();
  const Eigen::Vector3d axis = base_T_depth.rotation().col(2);
  Capsules blocking;
  for (const Capsule& capsule : place(context.body.capsules, frames)) {
    if (may_block(capsule, eye, axis, half_cone_rad_)) blocking.push_back(capsule);
  }
  if (blocking.empty()) return rays_;
  worker.rays.ends_m.clear();
  for (const Eigen::Vector3d& end : rays_.ends_m) {
    const Eigen::Vector3d to = base_T_depth * end;
    const bool blocked = std::any_of(blocking.begin(), blocking.end(), [&](const Capsule& c) {
      return segment_distance_m(eye, to, c.a, c.b) <= c.radius_m;
    });
    if (!blocked) worker.rays.ends_m.push_back(end);
  }
  return worker.rays;
}

ViewGain GainModel::count(const ViewContext& context, const JointVector& q_rad, GainWorker& worker) const {
  const LinkFrames frames = forward(context.arm, q_rad);
  const Transform<Base, Depth> base_T_depth = frames.flange() * context.flange_T_depth;
  const GainRays& rays = free_rays(context, frames, base_T_depth, worker);
  const GainCount counted = count_unknown(plane_, rays, base_T_depth, sensor_.range_min_m, worker.scratch);
  const auto unknown = static_cast<std::uint32_t>((counted.weight - counted.voxels) / (kUnknownWeight - kAgainWeight));
  ViewGain gain{.unknown = unknown, .again = counted.voxels - unknown};
  if (context.prior != nullptr) {
    gain.expected_surface =
        count_unknown(*prior_plane_, rays, base_T_depth, sensor_.range_min_m, worker.scratch).voxels;
  }
  return gain;
}

std::size_t GainModel::remember_look(const ViewContext& context, const JointVector& q_rad, GainWorker& worker) {
  const LinkFrames frames = forward(context.arm, q_rad);
  const Transform<Base, Depth> base_T_depth = frames.flange() * context.flange_T_depth;
  const GainRays& rays = free_rays(context, frames, base_T_depth, worker);
  std::size_t futile = 0;
  worker.scratch.begin();
  for (const Eigen::Vector3d& end : rays.ends_m) {
    walk_ray(geometry_, base_T_depth.translation(), base_T_depth * end, [&](std::size_t i, double entry) {
      const VoxelClass voxel = context.map.voxel_class(i);
      const bool in_range = entry * end.z() >= sensor_.range_min_m;
      const bool unknown = voxel == VoxelClass::kUnknown;
      if (in_range && context.zone[i] != 0 && (unknown || needs_again(context, i)) && worker.scratch.mark(i)) {
        futile_.add(i);
        ++futile;
      }
      return voxel == VoxelClass::kFree || (unknown && !in_range);
    });
  }
  return futile;
}

}  // namespace firstlook
