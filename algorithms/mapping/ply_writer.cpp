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

constexpr std::size_t kPointBytes = 16;  // three floats, three colours, one class

std::array<std::byte, kPointBytes> encode(const Eigen::Vector3d& center_m, double height_fraction,
                                          VoxelClass voxel_class) {
  std::array<std::byte, kPointBytes> bytes{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto value = std::bit_cast<std::array<std::byte, 4>>(static_cast<float>(center_m[static_cast<int>(axis)]));
    std::copy(value.begin(), value.end(), bytes.begin() + static_cast<std::ptrdiff_t>(4 * axis));
  }
  const std::array<std::uint8_t, 3> color = height_color(height_fraction);
  for (std::size_t i = 0; i < 3; ++i) bytes[12 + i] = static_cast<std::byte>(color[i]);
  bytes[15] = static_cast<std::byte>(voxel_class);
  return bytes;
}

}  // namespace

void write_ply(const VoxelMap& map, bool with_free, ByteSink sink) {
  const VoxelCounts counts = map.counts();
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment voxel centres, resolution {} m, class 1 free 2 occupied\n"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
      "property uchar green\nproperty uchar blue\nproperty uchar class\nend_header\n",
      map.geometry().resolution_m, counts.occupied + (with_free ? counts.free : 0));
  sink(std::as_bytes(std::span(header)));
  for (std::size_t i = 0; i < map.size(); ++i) {
    const VoxelClass voxel_class = map.voxel_class(i);
    if (voxel_class == VoxelClass::kUnknown || (voxel_class == VoxelClass::kFree && !with_free)) continue;
    const Eigen::Vector3i voxel = map.geometry().voxel_at(i);
    const double fraction = (voxel.z() + 0.5) / map.geometry().size.z();
    sink(encode(map.geometry().center_m(voxel), fraction, voxel_class));
  }
}

}  // namespace firstlook
