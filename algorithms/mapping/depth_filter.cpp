#include "algorithms/mapping/depth_filter.hpp"

#include <algorithm>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

GridGeometry cubes_over(const GridGeometry& map, double voxel_m) {
  if (voxel_m <= 0) return {};
  const Eigen::Vector3d low_m = map.first.cast<double>() * map.resolution_m;
  const Eigen::Vector3d high_m = (map.first + map.size).cast<double>() * map.resolution_m;
  return GridGeometry::covering(low_m, high_m, voxel_m);
}

std::size_t words(const GridGeometry& cubes) { return (cubes.count() + 63) / 64; }

}  // namespace

DepthFilter::DepthFilter(const GridGeometry& map, const DepthSensor& sensor, const DepthFilterOptions& options)
    : options_(options), rays_(sensor), cubes_(cubes_over(map, options.voxel_m)), taken_(words(cubes_)) {
  ENSURE(3120, options.crop_m >= 0 && options.voxel_m >= 0);
}

std::size_t DepthFilter::required_bytes(const GridGeometry& map, const DepthSensor& sensor,
                                        const DepthFilterOptions& options) {
  return DepthRays::required_bytes(sensor) + words(cubes_over(map, options.voxel_m)) * sizeof(std::uint64_t);
}

DepthFilterResult DepthFilter::apply(ImageView<std::uint16_t> pixels, double units_per_m,
                                     const Transform<Base, Depth>& base_T_depth) {
  DepthFilterResult result;
  std::ranges::fill(taken_, 0);
  const Eigen::Vector3d from_m = base_T_depth.translation();
  const DepthImage depth{{pixels.data, pixels.width, pixels.height}, units_per_m};
  rays_.for_each_row(depth, base_T_depth, {}, [&](int v, const RayRow& row) {
    for (int u = 0; u < pixels.width; ++u) {
      const auto i = static_cast<std::size_t>(u);
      if (row.kind[i] > PixelKind::kBeyond) continue;
      const Eigen::Vector3d end_m = Eigen::Vector3f(row.end_x_m[i], row.end_y_m[i], row.end_z_m[i]).cast<double>();
      if (options_.crop_m > 0 && (end_m - from_m).norm() > options_.crop_m) {
        pixels.at(u, v) = 0;
        ++result.pixels_cropped;
        continue;
      }
      if (options_.voxel_m <= 0 || row.kind[i] != PixelKind::kHit) continue;
      const Eigen::Vector3i cube = cubes_.voxel(end_m);
      if (!cubes_.contains(cube)) continue;
      const std::size_t index = cubes_.index(cube);
      const std::uint64_t bit = 1ULL << (index & 63);
      if ((taken_[index >> 6] & bit) != 0) {
        pixels.at(u, v) = 0;
        ++result.pixels_thinned;
      }
      taken_[index >> 6] |= bit;
    }
  });
  return result;
}

}  // namespace firstlook
