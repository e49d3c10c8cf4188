/// What became of an earlier map of the same place.
#pragma once

#include <span>

#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// Voxels of two maps of one grid: the earlier is only a hint, the later was seen.
struct MapChange {
  std::size_t still_occupied = 0;
  std::size_t newly_occupied = 0;  ///< the earlier map knew it free
  std::size_t gone = 0;            ///< occupied in the earlier map, now seen free
  std::size_t still_free = 0;
  std::size_t unseen_occupied = 0;  ///< occupied in the earlier map, not seen this time
  std::size_t unseen_free = 0;      ///< free in the earlier map, not seen this time: unknown, as far as motion goes
  std::size_t first_known = 0;      ///< unknown in the earlier map
  bool operator==(const MapChange&) const = default;
};

/// @param zone  empty, or one byte for each voxel: only those that are not 0 count
[[nodiscard]] MapChange compare_maps(const VoxelMap& earlier, const VoxelMap& later,
                                     std::span<const std::uint8_t> zone = {});

}  // namespace firstlook
