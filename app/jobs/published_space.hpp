/// The free space as the last completed job left it, for those who look at it from the loop thread: the guardian, and
/// whoever audits the motion.
#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "algorithms/motion/body.hpp"
#include "algorithms/motion/free_space.hpp"
#include "algorithms/motion/guardian.hpp"

namespace firstlook {

class PublishedSpace {
 public:
  // What the bits of the published bytes say of a voxel: free for motion; taken out of the safe zone; seen by the map.
  static constexpr std::uint8_t kFreeVoxel = 1, kRevokedVoxel = 2, kKnownVoxel = 4;

  PublishedSpace(const GridGeometry& geometry, double distance_max_m)
      : next_field_(geometry, distance_max_m),
        field_(geometry, distance_max_m),
        next_revoked_(geometry, distance_max_m),
        revoked_(geometry, distance_max_m),
        next_free_(geometry.count(), 0),
        free_(geometry.count(), 0) {}

  /// From a job: what will be seen from the next take() on. `field` may be null: only the zone counts.
  void publish(const FreeSpace& space, const Body& body, const Clearance& guardian_clearance,
               std::span<const std::uint8_t> voxels) {
    const std::lock_guard lock(mutex_);
    has_field_ = space.field != nullptr;
    if (has_field_) next_field_ = *space.field;
    if (space.revoked != nullptr) next_revoked_ = *space.revoked;
    next_space_ = space;
    next_body_ = body;
    next_clearance_ = guardian_clearance;
    std::copy(voxels.begin(), voxels.end(), next_free_.begin());
    fresh_ = true;
  }
  /// From the loop thread, when a job's completion is dispatched.
  void take() {
    const std::lock_guard lock(mutex_);
    if (!fresh_) return;
    fresh_ = false;
    ++revision_;
    std::swap(field_, next_field_);  // publish() writes it anew
    space_ = next_space_;
    space_.field = has_field_ ? &field_ : nullptr;
    if (space_.revoked != nullptr) {
      std::swap(revoked_, next_revoked_);
      space_.revoked = &revoked_;
    }
    mapped_ = has_field_;
    body_ = next_body_;
    clearance_ = next_clearance_;
    free_.swap(next_free_);
  }

  /// The guardian's verdict on a configuration; loop thread.
  [[nodiscard]] GuardianVerdict judge(const ArmModel& arm, const JointVector& q_rad) const {
    return check(arm, body_, space_, clearance_, q_rad, std::nullopt);
  }
  /// Whether there is a map; before, the safe zone's cylinder is all that is free. Loop thread.
  [[nodiscard]] bool mapped() const { return mapped_; }
  [[nodiscard]] const GridGeometry& geometry() const { return field_.geometry(); }
  [[nodiscard]] bool free_for_motion(std::size_t voxel) const { return (free_[voxel] & kFreeVoxel) != 0; }
  [[nodiscard]] bool zone_revoked(std::size_t voxel) const { return (free_[voxel] & kRevokedVoxel) != 0; }
  [[nodiscard]] bool known(std::size_t voxel) const { return (free_[voxel] & kKnownVoxel) != 0; }
  /// Grows by one with each change of what is published.
  [[nodiscard]] std::uint32_t revision() const { return revision_; }
  [[nodiscard]] const FreeSpace& space() const { return space_; }

 private:
  std::mutex mutex_;
  bool fresh_ = false;
  bool has_field_ = false;
  bool mapped_ = false;
  std::uint32_t revision_ = 0;
  DistanceField next_field_, field_;
  DistanceField next_revoked_, revoked_;
  FreeSpace next_space_, space_;
  Body next_body_, body_;
  Clearance next_clearance_, clearance_;
  std::vector<std::uint8_t> next_free_, free_;
};

}  // namespace firstlook
