#include "algorithms/mapping/moveit_scene.hpp"

#include <fmt/format.h>

#include <string>

namespace firstlook {
namespace {

// Occupied voxels that no box covers yet.
class Uncovered {
 public:
  Uncovered(const VoxelMap& map, ClassReading reading) : geometry_(map.geometry()), open_(map.size(), false) {
    for (std::size_t i = 0; i < map.size(); ++i) open_[i] = reading(map, i) == VoxelClass::kOccupied;
  }
  [[nodiscard]] bool at(std::size_t index) const { return open_[index]; }
  // True when every voxel of the block from low to high (exclusive) is open.
  [[nodiscard]] bool whole(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
    if (!geometry_.contains(high - Eigen::Vector3i::Ones())) return false;
    bool all = true;
    for_each(low, high, [&](std::size_t index) { all = all && open_[index]; });
    return all;
  }
  void cover(const Eigen::Vector3i& low, const Eigen::Vector3i& high) {
    for_each(low, high, [&](std::size_t index) { open_[index] = false; });
  }

 private:
  template <typename Visit>
  void for_each(const Eigen::Vector3i& low, const Eigen::Vector3i& high, Visit visit) const {
    for (int z = low.z(); z < high.z(); ++z)
      for (int y = low.y(); y < high.y(); ++y)
        for (int x = low.x(); x < high.x(); ++x) visit(geometry_.index({x, y, z}));
  }

  GridGeometry geometry_;
  std::vector<bool> open_;
};

}  // namespace

std::vector<AxisBox> merge_occupied(const VoxelMap& map, ClassReading reading) {
  const GridGeometry& g = map.geometry();
  Uncovered uncovered(map, reading);
  std::vector<AxisBox> boxes;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (!uncovered.at(i)) continue;
    const Eigen::Vector3i low = g.voxel_at(i);
    Eigen::Vector3i high = low + Eigen::Vector3i::Ones();
    for (int axis = 0; axis < 3; ++axis) {
      while (true) {  // the next layer along this axis
        Eigen::Vector3i layer_low = low, layer_high = high;
        layer_low[axis] = high[axis];
        layer_high[axis] = high[axis] + 1;
        if (!uncovered.whole(layer_low, layer_high)) break;
        ++high[axis];
      }
    }
    uncovered.cover(low, high);
    boxes.push_back(
        {(g.first + low).cast<double>() * g.resolution_m, (g.first + high).cast<double>() * g.resolution_m});
  }
  return boxes;
}

void write_moveit_scene(std::span<const AxisBox> boxes, std::string_view name, ByteSink sink) {
  const auto write = [&](const std::string& text) { sink(std::as_bytes(std::span(text))); };
  constexpr std::string_view kIdentityPose = "0 0 0\n0 0 0 1\n";
  write(fmt::format("{}\n* map\n{}{}\n", name, kIdentityPose, boxes.size()));
  for (const AxisBox& box : boxes) {
    const Eigen::Vector3d size_m = box.high_m - box.low_m, center_m = (box.high_m + box.low_m) / 2;
    write(fmt::format("box\n{:.6g} {:.6g} {:.6g}\n{:.6g} {:.6g} {:.6g}\n0 0 0 1\n0.6 0.6 0.6 1\n", size_m.x(),
                      size_m.y(), size_m.z(), center_m.x(), center_m.y(), center_m.z()));
  }
  write("0\n.\n");
}

}  // namespace firstlook
