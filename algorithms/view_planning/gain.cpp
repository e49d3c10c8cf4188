#include "algorithms/view_planning/gain.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/mapping/remaining.hpp"
#include "algorithms/view_planning/ray_walk.hpp"

namespace firstlook {
namespace {

// Weights in the plane that tell the two kinds of voxels apart in one sum: unknown = (weight - voxels) / 3.
constexpr std::uint8_t kUnknownWeight = 4;
constexpr std::uint8_t kAgainWeight = 1;
constexpr std::uint8_t kPass = 0;
constexpr std::size_t kTile = 8;  // neighbouring rays that follow each other (GainRays)

/// Free in the map, but motion cannot use it: seen from one pose only, in part (but not beside a surface), doubted by
/// the latest frame, or so long ago that it soon cannot.
bool needs_again(const ViewContext& context, std::size_t index) {
  if (context.space.field == nullptr || context.map.voxel_class(index) != VoxelClass::kFree) return false;
  if (context.map.blocked(index) || context.map.holds_surface(index)) return false;
  return context.space.field->values()[index] <= 0 ||
         context.map.expires(index, context.fresh_until_s, context.free_max_age_s);
}

/// A free voxel of which a surface fills so many octants that what lies behind is mostly the inside of things. One with
/// fewer is an edge, of an opening too, and rays pass beside it.
bool hides_what_is_behind(const VoxelMap& map, std::size_t index) {
  const unsigned surface = map.octants(index).surface;
  const unsigned without_one = surface & (surface - 1);
  return (without_one & (without_one - 1)) != 0;  // three or more
}

/// Where on a segment (0 at `from`, 1 at `to`, clamped) a box lies behind; negative when it does not meet the box.
double leaves_box(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  double enters = 0, leaves = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = to[axis] - from[axis];
    const double low = box.min()[axis] - from[axis], high = box.max()[axis] - from[axis];
    if (way == 0) {
      if (low > 0 || high < 0) return -1;
      continue;
    }
    enters = std::max(enters, std::min(low / way, high / way));
    leaves = std::min(leaves, std::max(low / way, high / way));
  }
  return enters <= leaves ? leaves : -1;
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

/// A capsule in the frame of the sensor, and the sphere around it (a little more), which is cheaper to ask.
struct Obstacle {
  Capsule capsule;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double beyond_m2 = 0;  ///< of the squared distance to the center: what the sphere leaves of it

  /// Whether the capsule meets the ray from the sensor to a point `end` that is `length_m2`, squared, away.
  [[nodiscard]] bool blocks(const Eigen::Vector3d& end, double length_m2) const {
    const double along = center.dot(end);
    if (along * along < beyond_m2 * length_m2) return false;
    return segment_distance_m(Eigen::Vector3d::Zero(), end, capsule.a, capsule.b) <= capsule.radius_m;
  }
};

Obstacle obstacle_of(const Capsule& capsule) {
  constexpr double kRounding_m = 1e-6;
  const Eigen::Vector3d center = (capsule.a + capsule.b) / 2;
  const double radius_m = (capsule.b - capsule.a).norm() / 2 + capsule.radius_m + kRounding_m;
  return {.capsule = capsule, .center = center, .beyond_m2 = center.squaredNorm() - radius_m * radius_m};
}

}  // namespace

GainWorker::GainWorker(const GridGeometry& geometry, std::size_t rays_max) : scratch(geometry) {
  rays.ends_m.reserve(rays_max);
  returning.ends_m.reserve(rays_max);
}

GainModel::GainModel(const GridGeometry& geometry, const DepthSensor& sensor, const GainSampling& sampling)
    : geometry_(geometry),
      sensor_(sensor),
      sampling_(sampling),
      rays_(GainRays::pinhole(sensor.intrinsics, sampling.columns, sampling.rows,
                              std::min(sensor.range_max_m, sensor.range_trusted_m))),
      plane_(geometry),
      futile_(geometry),
      far_(geometry, sensor.range_max_m) {
  frontier_.reserve(geometry.count());
  for (const Eigen::Vector3d& end : rays_.ends_m) {
    half_cone_rad_ = std::max(half_cone_rad_, std::acos(std::clamp(end.z() / end.norm(), -1.0, 1.0)));
  }
}

std::size_t GainModel::required_bytes(const GridGeometry& geometry, const DepthSensor& sensor,
                                      const GainSampling& sampling) {
  const auto rays = static_cast<std::size_t>(sampling.columns) * static_cast<std::size_t>(sampling.rows);
  return GainPlane::required_bytes(geometry) + geometry.count() * (sizeof(std::uint8_t) + sizeof(std::uint32_t)) +
         rays * sizeof(Eigen::Vector3d) + FarReturns::required_bytes(geometry, sensor.range_max_m);
}

void GainModel::prepare(const ViewContext& context) {
  ENSURE(4511, context.map.geometry() == geometry_);
  ENSURE(4512, context.zone.size() == geometry_.count());
  unknown_ = 0;
  backed_only_m_.setEmpty();
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
        if (counts && needs_backing(i)) {
          const Eigen::Vector3d center_m = geometry_.center_m(geometry_.voxel_at(i));
          const Eigen::Vector3d half_m = Eigen::Vector3d::Constant(geometry_.resolution_m / 2);
          backed_only_m_.extend(Eigen::AlignedBox3d(center_m - half_m, center_m + half_m));
        }
        break;
      case VoxelClass::kFree:
        if (hides_what_is_behind(context.map, i)) {
          plane[i] = kOpaque;
        } else {
          const bool again = counts && futile_.count(i) < sampling_.again_futile_max && needs_again(context, i);
          plane[i] = again ? kAgainWeight : kPass;
        }
        break;
    }
  }
  for (const std::uint32_t i :
       find_specks(context.map, context.zone, static_cast<std::size_t>(sampling_.cluster_voxels_min))) {
    if (plane[i] == kUnknownWeight) plane[i] = kUnknownNoWeight;
  }
  if (!far_.knows_returns()) backed_only_m_.setEmpty();
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
    const bool backed_only = !backed_only_m_.isEmpty() && plane_.what()[i] == kOpaque && context.zone[i] != 0 &&
                             context.map.voxel_class(i) == VoxelClass::kUnknown && needs_backing(i);
    if (plane_.what()[i] != kUnknownWeight && !backed_only) continue;
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
  const Transform<Depth, Base> depth_T_base = base_T_depth.inverse();
  FixedVector<Obstacle, kCapsulesMax> obstacles;
  for (Capsule capsule : place(context.body.capsules, frames)) {
    if (!may_block(capsule, eye, axis, half_cone_rad_)) continue;
    capsule.a = depth_T_base * capsule.a;
    capsule.b = depth_T_base * capsule.b;
    obstacles.push_back(obstacle_of(capsule));
  }
  if (obstacles.empty()) return rays_;
  worker.rays.ends_m.clear();
  for (const Eigen::Vector3d& end : rays_.ends_m) {
    const double length_m2 = end.squaredNorm();
    const bool blocked = std::any_of(obstacles.begin(), obstacles.end(),
                                     [&](const Obstacle& obstacle) { return obstacle.blocks(end, length_m2); });
    if (!blocked) worker.rays.ends_m.push_back(end);
  }
  return worker.rays;
}

ViewGain GainModel::count_along(const GainRays& rays, const Transform<Base, Depth>& base_T_depth,
                                GainScratch& scratch) const {
  const GainCount counted = count_unknown(plane_, rays, base_T_depth, sensor_.range_min_m, scratch);
  const auto unknown = static_cast<std::uint32_t>((counted.weight - counted.voxels) / (kUnknownWeight - kAgainWeight));
  return {.unknown = unknown, .again = counted.voxels - unknown};
}

ViewGain GainModel::count(const ViewContext& context, const JointVector& q_rad, GainWorker& worker) const {
  ViewGain gain = count_at_most(context, q_rad, worker);
  find_doubtful(context, q_rad, worker, gain);
  return gain;
}

bool GainModel::assume_look(const ViewContext& context, const JointVector& q_rad, GainWorker& worker) {
  const LinkFrames frames = forward(context.arm, q_rad);
  const Transform<Base, Depth> base_T_depth = frames.flange() * context.flange_T_depth;
  const GainRays& rays = free_rays(context, frames, base_T_depth, worker);
  (void)count_along(rays, base_T_depth, worker.scratch);  // for its marks
  if (count_backed(context, base_T_depth, rays, worker.scratch) > 0) return false;
  const std::span<std::uint8_t> what = plane_.what();
  for (std::size_t i = 0; i < what.size(); ++i) {
    if (worker.scratch.is_marked(i)) what[i] = what[i] == kUnknownWeight ? kUnknownNoWeight : kPass;
  }
  plane_.prepare(UnknownReading::kSeeThrough);
  find_frontier(context);
  if (context.prior != nullptr) prepare_prior(context);
  return true;
}

void GainModel::find_doubtful(const ViewContext& context, const JointVector& q_rad, GainWorker& worker,
                              ViewGain& gain) const {
  gain.doubtful = gain.doubtful_again = 0;
  const std::uint32_t unknown = gain.unknown - gain.backed;
  if (!far_.knows_openings() || unknown + gain.again == 0) return;
  const LinkFrames frames = forward(context.arm, q_rad);
  const Transform<Base, Depth> base_T_depth = frames.flange() * context.flange_T_depth;
  const GainRays& rays = free_rays(context, frames, base_T_depth, worker);
  const GainRays& returning = returning_rays(base_T_depth, rays, worker);
  if (returning.ends_m.size() == rays.ends_m.size()) return;
  const ViewGain sure = count_along(returning, base_T_depth, worker.scratch);
  gain.doubtful = unknown - std::min(unknown, sure.unknown);
  gain.doubtful_again = gain.again - std::min(gain.again, sure.again);
}

ViewGain GainModel::count_at_most(const ViewContext& context, const JointVector& q_rad, GainWorker& worker) const {
  const LinkFrames frames = forward(context.arm, q_rad);
  const Transform<Base, Depth> base_T_depth = frames.flange() * context.flange_T_depth;
  const GainRays& rays = free_rays(context, frames, base_T_depth, worker);
  ViewGain gain = count_along(rays, base_T_depth, worker.scratch);
  gain.backed = count_backed(context, base_T_depth, rays, worker.scratch);
  gain.unknown += gain.backed;
  if (context.prior != nullptr) {
    gain.expected_surface =
        count_unknown(*prior_plane_, rays, base_T_depth, sensor_.range_min_m, worker.scratch).voxels;
  }
  return gain;
}

bool GainModel::is_backed(const VoxelMap& map, const Eigen::Vector3d& from_m, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d to_m = from_m + sensor_.range_max_m * direction;
  bool met = false;
  walk_ray(geometry_, from_m, to_m, [&](std::size_t i, double) {
    met = map.voxel_class(i) == VoxelClass::kOccupied;
    return !met;
  });
  return met || far_.lies_between(from_m, to_m);
}

std::uint32_t GainModel::count_backed(const ViewContext& context, const Transform<Base, Depth>& base_T_depth,
                                      const GainRays& rays, GainScratch& scratch) const {
  if (backed_only_m_.isEmpty()) return 0;
  const Eigen::Vector3d eye = base_T_depth.translation();
  const std::span<const std::uint8_t> what = plane_.what();
  const auto is_open = [what](std::size_t i) { return what[i] == kPass || what[i] == kAgainWeight; };
  std::uint32_t counted = 0;
  Passed passed;
  for (std::size_t r = 0; r < rays.ends_m.size(); r += kTile) {  // that finds what is worth a look
    pass_with_backing(context, eye, base_T_depth * rays.ends_m[r], rays.ends_m[r].z(), is_open, passed);
    for (const std::uint32_t i : passed) counted += scratch.mark(i) ? 1U : 0U;
  }
  return counted;
}

template <typename IsOpen>
void GainModel::pass_with_backing(const ViewContext& context, const Eigen::Vector3d& eye, const Eigen::Vector3d& end,
                                  double depth_m, IsOpen is_open, Passed& passed) const {
  passed.clear();
  const double last = backed_only_m_.isEmpty() ? -1 : leaves_box(backed_only_m_, eye, end);
  if (last < 0) return;
  walk_ray(geometry_, eye, eye + last * (end - eye), [&](std::size_t i, double entry) {
    if (is_open(i)) return true;
    const VoxelClass voxel = context.map.voxel_class(i);
    if (voxel == VoxelClass::kOccupied || hides_what_is_behind(context.map, i)) return false;
    if (voxel == VoxelClass::kFree || entry * last * depth_m < sensor_.range_min_m) return true;
    if (futile_.backed(i) >= sampling_.futile_max) return false;
    if (context.zone[i] != 0 && needs_backing(i) && !passed.full()) passed.push_back(static_cast<std::uint32_t>(i));
    return true;
  });
  if (!passed.empty() && !is_backed(context.map, eye, (end - eye).normalized())) passed.clear();
}

const GainRays& GainModel::returning_rays(const Transform<Base, Depth>& base_T_depth, const GainRays& rays,
                                          GainWorker& worker) const {
  const Eigen::Vector3d eye = base_T_depth.translation();
  worker.returning.ends_m.clear();
  // A tile is as wide as the cells of far_ are from a few metres: one of its rays speaks for it.
  for (std::size_t first = 0; first < rays.ends_m.size(); first += kTile) {
    const auto tile = std::span(rays.ends_m).subspan(first, std::min(kTile, rays.ends_m.size() - first));
    const Eigen::Vector3d& middle = tile[tile.size() / 2];
    const Eigen::Vector3d far_end = base_T_depth * Eigen::Vector3d(middle * (sensor_.range_max_m / middle.norm()));
    if (!far_.is_open(eye, far_end))
      worker.returning.ends_m.insert(worker.returning.ends_m.end(), tile.begin(), tile.end());
  }
  return worker.returning;
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
      // A voxel that this look has just freed for the first time was not looked at in vain.
      const bool in_vain = unknown || (plane_.what()[i] == kAgainWeight && needs_again(context, i));
      if (in_range && context.zone[i] != 0 && in_vain && worker.scratch.mark(i)) {
        futile_.add(i, unknown && is_backed(context.map, base_T_depth.translation(),
                                            (base_T_depth * end - base_T_depth.translation()).normalized()));
        ++futile;
      }
      // What counts nothing hides nothing from the gain, either.
      return voxel == VoxelClass::kFree || (unknown && (!in_range || plane_.what()[i] == kUnknownNoWeight));
    });
  }
  // What only rays with a surface behind still count, all along such a ray: it should have told of each.
  worker.scratch.begin();
  const Eigen::Vector3d eye = base_T_depth.translation();
  const auto never = [](std::size_t) { return false; };  // the plane is of before the look
  Passed passed;
  for (const Eigen::Vector3d& end : rays.ends_m) {
    pass_with_backing(context, eye, base_T_depth * end, end.z(), never, passed);
    for (const std::uint32_t i : passed) {
      if (worker.scratch.mark(i)) futile_.add(i, true);
    }
  }
  return futile;
}

}  // namespace firstlook
