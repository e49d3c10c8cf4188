#include "algorithms/mapping/ply_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <string>

#include "algorithms/mapping/height_color.hpp"

namespace firstlook {
namespace {

static_assert(std::endian::native == std::endian::little, "the file is little-endian and written as the memory is");

/// One voxel's line of the file, property by property.
class PointRecord {
 public:
  template <typename Value>
  void add(Value value) {
    const auto bytes = std::bit_cast<std::array<std::byte, sizeof(Value)>>(value);
    std::ranges::copy(bytes, bytes_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += bytes.size();
  }
  [[nodiscard]] std::span<const std::byte> bytes() const { return std::span(bytes_).first(size_); }

 private:
  std::array<std::byte, 3 * sizeof(float) + 3 + 1 + 3 + 1> bytes_{};  // all that there may be
  std::size_t size_ = 0;
};

std::string header_text(const VoxelMap& map, std::size_t points, const MapPlanes& planes) {
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment voxel centres, resolution {} m, class 1 free 2 occupied\n",
      map.geometry().resolution_m);
  if (planes.color) text += fmt::format("{}, white where none is known\n", kColorComment);
  if (planes.label) text += "comment label 0 no object, shape 1 plane 2 box 3 other\n";
  text += fmt::format(
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nproperty uchar class\n",
      points);
  if (planes.label) text += "property ushort label\nproperty uchar shape\n";
  if (planes.sensor) text += "property uchar sensor\n";
  return text + "end_header\n";
}

PointRecord record_of(const VoxelMap& map, std::size_t index, const MapPlanes& planes) {
  const Eigen::Vector3i voxel = map.geometry().voxel_at(index);
  const Eigen::Vector3d center_m = map.geometry().center_m(voxel);
  PointRecord record;
  for (int axis = 0; axis < 3; ++axis) record.add(static_cast<float>(center_m[axis]));
  const double height = (voxel.z() + 0.5) / map.geometry().size.z();
  record.add(planes.color ? planes.color->at(index).value_or(kNoColor) : height_color(height));
  record.add(map.voxel_class(index));
  if (planes.label) {
    const VoxelLabel& label = planes.label->at(index);
    record.add(label.object);
    record.add(shape_number(label));
  }
  if (planes.sensor) record.add(planes.sensor->at(index));
  return record;
}

}  // namespace

void write_ply(const VoxelMap& map, bool with_free, ByteSink sink, const MapPlanes& planes) {
  const VoxelCounts counts = map.counts();
  const std::string header = header_text(map, counts.occupied + (with_free ? counts.free : 0), planes);
  sink(std::as_bytes(std::span(header)));
  for (std::size_t i = 0; i < map.size(); ++i) {
    const VoxelClass voxel_class = map.voxel_class(i);
    if (voxel_class == VoxelClass::kUnknown || (voxel_class == VoxelClass::kFree && !with_free)) continue;
    sink(record_of(map, i, planes).bytes());
  }
}

}  // namespace firstlook
