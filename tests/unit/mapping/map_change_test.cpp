#include "algorithms/mapping/map_change.hpp"

#include <catch2/catch.hpp>

namespace firstlook {

TEST_CASE("each pair of classes is one kind of change", "[mapping]") {
  VoxelMap earlier(GridGeometry{0.1, {0, 0, 0}, {9, 2, 1}}), later(earlier.geometry());
  constexpr VoxelClass kClasses[] = {VoxelClass::kUnknown, VoxelClass::kFree, VoxelClass::kOccupied};
  for (std::size_t i = 0; i < 9; ++i) {
    earlier.set(i, kClasses[i / 3], 0);
    later.set(i, kClasses[i % 3], 0);
    earlier.set(9 + i, VoxelClass::kOccupied, 0);
    later.set(9 + i, VoxelClass::kFree, 0);
  }
  std::vector<std::uint8_t> zone(18, 0);
  std::fill_n(zone.begin(), 9, std::uint8_t{1});
  CHECK(compare_maps(earlier, later, zone) == MapChange{1, 1, 1, 1, 1, 1, 2});
  CHECK(compare_maps(earlier, later).gone == 10);
}

}  // namespace firstlook
