#include "algorithms/mapping/voxel_map.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/mapping/log_odds_update.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

// Reference poses kept; a run has tens of views, and a few hundred frames between them. Beyond it ids are shared with
// the nearest pose, whose radius grows: that only makes poses count as equal that are not.
constexpr std::size_t kPosesMax = 4096;
// Frames this near to a reference pose share its id: the arm standing still.
constexpr double kSamePoseMax_m = 0.002;
constexpr double kSamePoseMax_rad = 0.0035;

constexpr double kBoundaryEpsilon_m = 1e-9;  // faces that coincide do not overlap

struct VoxelBox {
  Eigen::Vector3d low_m;
  Eigen::Vector3d high_m;
};

VoxelBox voxel_box(const GridGeometry& geometry, std::size_t index) {
  const Eigen::Vector3d center_m = geometry.center_m(geometry.voxel_at(index));
  const Eigen::Vector3d half_m = Eigen::Vector3d::Constant(geometry.resolution_m / 2);
  return {center_m - half_m, center_m + half_m};
}

bool inside(const SafeZone& zone, const VoxelBox& voxel) {
  const double x_m = std::max(std::abs(voxel.low_m.x()), std::abs(voxel.high_m.x()));
  const double y_m = std::max(std::abs(voxel.low_m.y()), std::abs(voxel.high_m.y()));
  return std::hypot(x_m, y_m) <= zone.radius_m && voxel.low_m.z() >= zone.floor_m - kBoundaryEpsilon_m &&
         voxel.high_m.z() <= zone.floor_m + zone.height_m + kBoundaryEpsilon_m;
}

template <typename Visit>
void for_each_bit(std::uint64_t word, std::size_t first_index, Visit visit) {
  while (word != 0) {
    visit(first_index + static_cast<std::size_t>(std::countr_zero(word)));
    word &= word - 1;
  }
}

}  // namespace

VoxelMap::VoxelMap(const GridGeometry& geometry, Planes planes) : geometry_(geometry) {
  ENSURE(3001, geometry.resolution_m > 0 && (geometry.size.array() > 0).all());
  log_odds_.assign(geometry.count(), kUnknownLogOdds);
  if (planes == Planes::kLogOddsOnly) return;
  flags_.assign(geometry.count(), 0);
  octants_.assign(geometry.count(), {});
  first_free_pose_.assign(geometry.count(), 0);
  if (planes == Planes::kWithOpenRays) first_open_pose_.assign(geometry.count(), 0);
  seen_s_.assign(geometry.count(), 0);
  poses_.reserve(kPosesMax);
  different_.assign(kPosesMax + 1, 0);
}

VoxelMap::VoxelMap(const GridGeometry& geometry, std::vector<std::int8_t> log_odds)
    : geometry_(geometry), log_odds_(std::move(log_odds)) {
  ENSURE(3006, log_odds_.size() == geometry.count());
}

std::size_t VoxelMap::required_bytes(const GridGeometry& geometry, Planes planes) {
  if (planes == Planes::kLogOddsOnly) return geometry.count();
  return geometry.count() * (sizeof(std::int8_t) + sizeof(std::uint8_t) + sizeof(Octants) + sizeof(std::uint16_t) +
                             sizeof(std::uint32_t) + (planes == Planes::kWithOpenRays ? sizeof(std::uint16_t) : 0)) +
         kPosesMax * (sizeof(SeenFrom) + 1);
}

VoxelClass VoxelMap::class_at(const Eigen::Vector3d& point_m) const {
  const double far_m = 2e9 * geometry_.resolution_m;  // beyond it voxel coordinates do not fit an int
  if (!(point_m.cwiseAbs().maxCoeff() < far_m) || !point_m.allFinite()) return VoxelClass::kUnknown;
  const Eigen::Vector3i voxel = geometry_.voxel(point_m);
  return geometry_.contains(voxel) ? voxel_class(geometry_.index(voxel)) : VoxelClass::kUnknown;
}

VoxelCounts VoxelMap::counts() const {
  VoxelCounts counts;
  for (const std::int8_t value : log_odds_) {
    counts.unknown += value == kUnknownLogOdds;
    counts.occupied += value >= 0;
  }
  counts.free = log_odds_.size() - counts.unknown - counts.occupied;
  return counts;
}

bool VoxelMap::known_free(std::size_t index, double now_s, double free_max_age_s) const {
  if (!has_motion_planes()) return false;
  const std::int8_t value = log_odds_[index];
  if (value == kUnknownLogOdds || value > kKnownFreeLogOdds) return false;
  if ((flags_[index] & (kFreeFromTwoPoses | kHitInLatestFrame | kForgotten)) != kFreeFromTwoPoses) return false;
  if (octants_[index].not_crossed() != 0) return false;
  const double age_s = now_s - static_cast<double>(seen_s_[index]);
  return age_s >= 0 && age_s <= free_max_age_s;
}

void VoxelMap::free_mask(double now_s, double free_max_age_s, std::span<std::uint8_t> out) const {
  ENSURE(3002, out.size() == size());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = !blocked(i) && (in_intact_safe_zone(i) || known_free(i, now_s, free_max_age_s)) ? 1 : 0;
}

void VoxelMap::set_safe_zone(const SafeZone& zone) {
  for (std::size_t i = 0; i < flags_.size(); ++i) {
    flags_[i] = static_cast<std::uint8_t>(flags_[i] & ~(kInSafeZone | kZoneRevoked));
    if (inside(zone, voxel_box(geometry_, i))) flags_[i] |= kInSafeZone;
  }
}

void VoxelMap::note_fixed_body(const Capsule& capsule, double margin_m) {
  const double reach_m = capsule.radius_m + margin_m + geometry_.resolution_m / 2;
  for (std::size_t i = 0; i < flags_.size(); ++i) {
    const Eigen::Vector3d center = geometry_.center_m(geometry_.voxel_at(i));
    if (segment_distance_m(center, center, capsule.a, capsule.b) < reach_m) flags_[i] |= kFixedBody;
  }
}

bool VoxelMap::in_intact_safe_zone(std::size_t index) const {
  return has_motion_planes() && (flags_[index] & (kInSafeZone | kZoneRevoked)) == kInSafeZone;
}

bool VoxelMap::zone_revoked(std::size_t index) const {
  return has_motion_planes() && (flags_[index] & kZoneRevoked) != 0;
}

void VoxelMap::block(const AxisBox& box) {
  for (std::size_t i = 0; i < flags_.size(); ++i) {
    const VoxelBox voxel = voxel_box(geometry_, i);
    const bool overlaps = ((voxel.high_m - box.low_m).array() > kBoundaryEpsilon_m).all() &&
                          ((box.high_m - voxel.low_m).array() > kBoundaryEpsilon_m).all();
    if (overlaps) flags_[i] |= kBlocked;
  }
}

void VoxelMap::block(const HalfSpace& half_space) {
  // The corner of a voxel farthest along the normal lies this far beyond its centre.
  const double corner_m = half_space.normal.cwiseAbs().sum() * geometry_.resolution_m / 2;
  for (std::size_t i = 0; i < flags_.size(); ++i) {
    const double center_m = half_space.normal.dot(geometry_.center_m(geometry_.voxel_at(i)));
    if (center_m + corner_m > half_space.offset_m + kBoundaryEpsilon_m) flags_[i] |= kBlocked;
  }
}

bool VoxelMap::blocked(std::size_t index) const { return has_motion_planes() && (flags_[index] & kBlocked) != 0; }

void VoxelMap::forget_known_free() {
  for (std::uint8_t& flags : flags_) flags |= kForgotten;
}

FrameChange VoxelMap::apply(std::span<const std::uint64_t> missed, std::span<const std::uint64_t> hits,
                            const Transform<Base, Depth>& base_T_depth, double stamp_s, std::size_t first_word) {
  ENSURE(3003, first_word + missed.size() <= bit_words(geometry_) && hits.size() == missed.size());
  const Frame frame = begin_frame(base_T_depth, stamp_s);
  const std::size_t first = std::min(size(), first_word * 64), last = std::min(size(), first + missed.size() * 64);
  if (!has_motion_planes()) return update_log_odds(missed, hits, std::span(log_odds_).subspan(first, last - first));
  FrameChange change;
  for (std::size_t word = 0; word < missed.size(); ++word) {
    const std::size_t voxel = first + word * 64;
    for_each_bit(missed[word] & ~hits[word], voxel, [&](std::size_t index) { miss(index, frame, change); });
    for_each_bit(hits[word], voxel, [&](std::size_t index) { hit(index, frame, change); });
  }
  return change;
}

FrameChange VoxelMap::apply_open(std::span<std::uint64_t> passed, const Transform<Base, Depth>& base_T_depth,
                                 double stamp_s) {
  ENSURE(3008, passed.size() == bit_words(geometry_) && !first_open_pose_.empty());
  const Frame frame = begin_frame(base_T_depth, stamp_s);
  FrameChange change;
  const auto is_confirmed = [&](std::size_t index) {
    std::uint16_t& first = first_open_pose_[index];
    if (first == 0) first = frame.pose_id;
    const bool open = (flags_[index] & (kSuspect | kHitInLatestFrame)) == 0 && octants_[index].surface == 0;
    return open && voxel_class(index) != VoxelClass::kOccupied && different_[first] != 0;
  };
  for (std::size_t word = 0; word < passed.size(); ++word) {
    std::uint64_t confirmed = 0;
    for_each_bit(passed[word], word * 64, [&](std::size_t index) {
      if (is_confirmed(index)) confirmed |= 1ULL << (index & 63);
    });
    for_each_bit(confirmed, word * 64, [&](std::size_t index) { miss(index, frame, change); });
    passed[word] = confirmed;
  }
  return change;
}

void VoxelMap::suspect(std::span<const std::uint64_t> voxels) {
  ENSURE(3007, voxels.size() == bit_words(geometry_) && has_motion_planes());
  for (std::size_t word = 0; word < voxels.size(); ++word)
    for_each_bit(voxels[word], word * 64, [&](std::size_t index) { flags_[index] |= kSuspect; });
}

std::size_t VoxelMap::forget_old_occupied(double now_s, double max_age_s) {
  std::size_t forgotten = 0;
  for (std::size_t i = 0; i < flags_.size(); ++i) {
    if (voxel_class(i) != VoxelClass::kOccupied || !expires(i, now_s, max_age_s)) continue;
    set(i, VoxelClass::kUnknown, static_cast<double>(seen_s_[i]));
    ++forgotten;
  }
  return forgotten;
}

VoxelMap::Frame VoxelMap::begin_frame(const Transform<Base, Depth>& base_T_depth, double stamp_s) {
  ENSURE(3004, stamp_s >= 0 && stamp_s < 4294967295.0);
  Frame frame;
  frame.stamp_s = static_cast<std::uint32_t>(stamp_s);
  if (has_motion_planes()) {
    frame.pose_id = pose_id(base_T_depth);
    mark_different_poses(base_T_depth);
  }
  return frame;
}

void VoxelMap::miss(std::size_t index, const Frame& frame, FrameChange& change) {
  std::int8_t& value = log_odds_[index];
  ++change.voxels_missed;
  change.voxels_discovered += value == kUnknownLogOdds;
  const int before = value == kUnknownLogOdds ? 0 : value;
  value = static_cast<std::int8_t>(std::max(before + kMissLogOdds, kLogOddsMin));
  if (!has_motion_planes()) return;
  flags_[index] = static_cast<std::uint8_t>(flags_[index] & ~(kHitInLatestFrame | kForgotten));
  seen_s_[index] = frame.stamp_s;
  if (first_free_pose_[index] == 0)
    first_free_pose_[index] = frame.pose_id;
  else if (different_[first_free_pose_[index]] != 0)
    flags_[index] |= kFreeFromTwoPoses;
}

void VoxelMap::hit(std::size_t index, const Frame& frame, FrameChange& change) {
  std::int8_t& value = log_odds_[index];
  ++change.voxels_hit;
  change.voxels_discovered += value == kUnknownLogOdds;
  const int before = value == kUnknownLogOdds ? 0 : value;
  value = static_cast<std::int8_t>(std::min(before + kHitLogOdds, kLogOddsMax));
  if (!has_motion_planes()) return;
  if (in_intact_safe_zone(index) && !is_fixed_body(index)) {
    ++change.zone_revoked;
    flags_[index] |= kZoneRevoked;
  }
  flags_[index] |= kHitInLatestFrame;
  seen_s_[index] = frame.stamp_s;
}

std::uint16_t VoxelMap::pose_id(const Transform<Base, Depth>& base_T_depth) {
  const Eigen::Vector3d position_m = base_T_depth.translation();
  const Eigen::Quaterniond rotation = base_T_depth.quaternion();
  std::size_t nearest = 0;
  double nearest_measure = 0, moved_m = 0, turned_rad = 0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const double d_m = (poses_[i].position_m - position_m).norm();
    const double d_rad = poses_[i].rotation.angularDistance(rotation);
    const double measure = std::max(d_m / kSamePoseMax_m, d_rad / kSamePoseMax_rad);
    if (i > 0 && measure >= nearest_measure) continue;
    nearest = i;
    nearest_measure = measure;
    moved_m = d_m;
    turned_rad = d_rad;
  }
  const bool same = !poses_.empty() && nearest_measure <= 1;
  if (!same && poses_.size() < kPosesMax) {
    poses_.push_back({position_m, rotation, 0, 0});
    return static_cast<std::uint16_t>(poses_.size());
  }
  poses_[nearest].radius_m = std::max(poses_[nearest].radius_m, moved_m);
  poses_[nearest].radius_rad = std::max(poses_[nearest].radius_rad, turned_rad);
  return static_cast<std::uint16_t>(nearest + 1);
}

void VoxelMap::mark_different_poses(const Transform<Base, Depth>& base_T_depth) {
  const Eigen::Vector3d position_m = base_T_depth.translation();
  const Eigen::Quaterniond rotation = base_T_depth.quaternion();
  // Triangle inequality: this far from the reference is far enough from every frame that shares its id.
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const bool moved = (poses_[i].position_m - position_m).norm() >= kDifferentPoseMin_m + poses_[i].radius_m;
    const bool turned = poses_[i].rotation.angularDistance(rotation) >= kDifferentPoseMin_rad + poses_[i].radius_rad;
    different_[i + 1] = moved || turned ? 1 : 0;
  }
}

void VoxelMap::set(std::size_t index, VoxelClass voxel_class, double stamp_s) {
  ENSURE(3005, index < size());
  constexpr std::int8_t kValues[] = {kUnknownLogOdds, kLogOddsMin, kLogOddsMax};
  log_odds_[index] = kValues[static_cast<std::size_t>(voxel_class)];
  if (!has_motion_planes()) return;
  constexpr std::uint8_t kKept = kInSafeZone | kZoneRevoked | kBlocked | kFixedBody | kSuspect;
  flags_[index] = static_cast<std::uint8_t>(flags_[index] & kKept);
  if (voxel_class == VoxelClass::kFree) flags_[index] |= kFreeFromTwoPoses;
  if (voxel_class == VoxelClass::kOccupied) flags_[index] |= kHitInLatestFrame;
  const bool revokes = voxel_class == VoxelClass::kOccupied && !is_fixed_body(index);
  if (revokes && (flags_[index] & kInSafeZone) != 0) flags_[index] |= kZoneRevoked;
  octants_[index] = {.surface = static_cast<std::uint8_t>(voxel_class == VoxelClass::kOccupied ? 0xFF : 0),
                     .crossed = static_cast<std::uint8_t>(voxel_class == VoxelClass::kFree ? 0xFF : 0)};
  first_free_pose_[index] = 0;
  seen_s_[index] = static_cast<std::uint32_t>(stamp_s);
}

}  // namespace firstlook
