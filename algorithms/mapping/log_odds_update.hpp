/// One frame's update of log-odds, 64 voxels at a time. Internal to algorithms/mapping.
#pragma once

#include <cstdint>
#include <span>

#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// VoxelMap::apply for a map of log-odds alone: a miss for each bit of `missed`, a hit for each of `hit`, occupied
/// before free, clamped. Bit i of word i / 64 is voxel i; voxels_discovered and the counts are those of these words.
FrameChange update_log_odds(std::span<const std::uint64_t> missed, std::span<const std::uint64_t> hit,
                            std::span<std::int8_t> log_odds);

}  // namespace firstlook
