#include "algorithms/mapping/map_change.hpp"

#include "platform/core/ensure.hpp"

namespace firstlook {

MapChange compare_maps(const VoxelMap& earlier, const VoxelMap& later, std::span<const std::uint8_t> zone) {
  ENSURE(3095, earlier.geometry() == later.geometry() && (zone.empty() || zone.size() == later.size()));
  constexpr auto kUnknown = VoxelClass::kUnknown, kFree = VoxelClass::kFree;
  MapChange change;
  for (std::size_t i = 0; i < later.size(); ++i) {
    if (!zone.empty() && zone[i] == 0) continue;
    const VoxelClass before = earlier.voxel_class(i), now = later.voxel_class(i);
    if (before == kUnknown) {
      change.first_known += now != kUnknown;
    } else if (now == kUnknown) {
      ++(before == kFree ? change.unseen_free : change.unseen_occupied);
    } else if (now == kFree) {
      ++(before == kFree ? change.still_free : change.gone);
    } else {
      ++(before == kFree ? change.newly_occupied : change.still_occupied);
    }
  }
  return change;
}

}  // namespace firstlook
