#include "algorithms/mapping/insertion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/mapping/passed_voxels.hpp"
#include "algorithms/mapping/ray_marker.hpp"
#include "platform/core/ensure.hpp"
#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

constexpr double kKeysMax = 32768;            // OctoMap's keys reach this far from zero
constexpr double kStampMax_s = 4294967294.0;  // the map keeps whole seconds in 32 bits
constexpr double kResolutionMin_m = 0.001;    // float points resolve it to a thousandth within 5 m

/// std::floor for numbers that fit an int, in a form that compilers vectorise.
[[gnu::always_inline]] inline std::int32_t floor_of(double value) {
  const auto towards_zero = static_cast<std::int32_t>(value);
  return towards_zero - static_cast<std::int32_t>(static_cast<double>(towards_zero) > value);
}

/// Where octomap_voxel() puts the ends of a row, as indices; -1 outside the grid. Ends lie within OctoMap's keys.
[[gnu::always_inline]] inline void compute_indices(const GridGeometry& geometry, const float* const ends[3],
                                                   std::size_t count, std::int32_t* indices) {
  const double factor = 1.0 / geometry.resolution_m;
  const std::int32_t nx = geometry.size.x(), ny = geometry.size.y(), nz = geometry.size.z();
  const std::int32_t x0 = geometry.first.x(), y0 = geometry.first.y(), z0 = geometry.first.z();
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t x = floor_of(factor * static_cast<double>(ends[0][i])) - x0;
    const std::int32_t y = floor_of(factor * static_cast<double>(ends[1][i])) - y0;
    const std::int32_t z = floor_of(factor * static_cast<double>(ends[2][i])) - z0;
    const int inside = static_cast<int>(x >= 0) & static_cast<int>(x < nx) & static_cast<int>(y >= 0) &
                       static_cast<int>(y < ny) & static_cast<int>(z >= 0) & static_cast<int>(z < nz);
    indices[i] = inside != 0 ? (z * ny + y) * nx + x : -1;
  }
}
FIRSTLOOK_AVX2 void compute_indices_avx2(const GridGeometry& geometry, const float* const ends[3], std::size_t count,
                                         std::int32_t* indices) {
  compute_indices(geometry, ends, count, indices);
}
void compute_indices_portable(const GridGeometry& geometry, const float* const ends[3], std::size_t count,
                              std::int32_t* indices) {
  compute_indices(geometry, ends, count, indices);
}
void end_indices(const GridGeometry& geometry, const RayRow& row, std::span<std::int32_t> indices) {
  const float* const ends[3] = {row.end_x_m.data(), row.end_y_m.data(), row.end_z_m.data()};
  has_avx2() ? compute_indices_avx2(geometry, ends, indices.size(), indices.data())
             : compute_indices_portable(geometry, ends, indices.size(), indices.data());
}

}  // namespace

Inserter::Inserter(const GridGeometry& geometry, const DepthSensor& sensor)
    : geometry_(geometry), rays_(sensor), image_(sensor.intrinsics.width, sensor.intrinsics.height) {
  ENSURE(3021, geometry.resolution_m >= kResolutionMin_m && (geometry.size.array() > 0).all());
  ENSURE(3025, geometry.count() <= std::numeric_limits<std::int32_t>::max());
  row_reach_m_.resize(static_cast<std::size_t>(sensor.intrinsics.width));
  row_index_.resize(row_reach_m_.size());
  missed_.assign(VoxelMap::bit_words(geometry), 0);
  hit_.assign(VoxelMap::bit_words(geometry), 0);
}

std::size_t Inserter::required_bytes(const GridGeometry& geometry, const DepthSensor& sensor) {
  return 2 * VoxelMap::bit_words(geometry) * sizeof(std::uint64_t) + DepthRays::required_bytes(sensor) +
         RangeImage::required_bytes(sensor.intrinsics.width, sensor.intrinsics.height) +
         static_cast<std::size_t>(sensor.intrinsics.width) * (sizeof(float) + sizeof(std::int32_t));
}

Status Inserter::check_place(const Transform<Base, Depth>& base_T_depth, double stamp_s) const {
  if (!(stamp_s >= 0 && stamp_s < kStampMax_s)) return failure(Fault::kFrameRefused, "time stamp {} s", stamp_s);
  const double bound_m = kKeysMax * geometry_.resolution_m - rays_.range_m() - 1;
  if (base_T_depth.translation().cwiseAbs().maxCoeff() > bound_m)
    return failure(Fault::kFrameRefused, "its pose is more than {} m away", bound_m);
  return {};
}

Result<InsertionResult> Inserter::insert(VoxelMap& map, const DepthImage& depth,
                                         const Transform<Base, Depth>& base_T_depth,
                                         std::span<const float> self_depth_m, double stamp_s) {
  ENSURE(3024, map.geometry() == geometry_);
  if (Status status = rays_.check(depth, base_T_depth, self_depth_m); !status) return std::unexpected(status.error());
  if (Status status = check_place(base_T_depth, stamp_s); !status) return std::unexpected(status.error());
  std::fill(missed_.begin(), missed_.end(), 0);
  std::fill(hit_.begin(), hit_.end(), 0);
  InsertionResult result;
  if (rays_.is_pinhole())
    mark_by_voxels(depth, base_T_depth, self_depth_m, result);
  else
    mark_by_rays(depth, base_T_depth, self_depth_m, result);
  result.change = map.apply(missed_, hit_, base_T_depth, stamp_s);
  return result;
}

void Inserter::mark_hit(std::int32_t index) {
  if (index < 0) return;
  hit_[static_cast<std::size_t>(index) >> 6] |= 1ULL << (index & 63);
}

void Inserter::mark_by_rays(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                            std::span<const float> self_depth_m, PixelCounts& counts) {
  RayMarker marker(geometry_, base_T_depth.translation().cast<float>(), missed_);
  counts = rays_.for_each(depth, base_T_depth, self_depth_m, [&](const RayEnd& ray) {
    marker.mark_passed(ray.end_m);
    const Eigen::Vector3i voxel = octomap_voxel(geometry_, ray.end_m);
    if (ray.is_hit && geometry_.contains(voxel)) mark_hit(static_cast<std::int32_t>(geometry_.index(voxel)));
  });
}

void Inserter::mark_by_voxels(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                              std::span<const float> self_depth_m, PixelCounts& counts) {
  counts = rays_.for_each_row(depth, base_T_depth, self_depth_m, [&](int v, const RayRow& row) {
    for (std::size_t u = 0; u < row.kind.size(); ++u) {
      row_reach_m_[u] = row.kind[u] <= PixelKind::kBeyond ? row.reach_m[u] : RangeImage::kNoRay;
    }
    image_.set_row(v, row_reach_m_);
    end_indices(geometry_, row, row_index_);
    for (std::size_t u = 0; u < row.kind.size(); ++u) {
      if (row.kind[u] == PixelKind::kHit) mark_hit(row_index_[u]);
    }
  });
  image_.build_levels();
  PassedVoxels(geometry_, rays_, image_, depth, base_T_depth, hit_, missed_).mark();
}

}  // namespace firstlook
