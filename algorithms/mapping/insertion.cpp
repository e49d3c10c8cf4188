#include "algorithms/mapping/insertion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/mapping/octants.hpp"
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

/// Where octomap_voxel() and octant_of() put the ends of a row: 8 * index + octant, -1 outside the grid. Ends lie
/// within OctoMap's keys. A factor of two rounds nothing, so that half coordinates hold the voxel's.
[[gnu::always_inline]] inline void compute_octants(const GridGeometry& geometry, const float* const ends[3],
                                                   std::size_t count, std::int32_t* octants) {
  const double halves = 2.0 / geometry.resolution_m;
  const std::int32_t nx = geometry.size.x(), ny = geometry.size.y(), nz = geometry.size.z();
  const std::int32_t x0 = geometry.first.x(), y0 = geometry.first.y(), z0 = geometry.first.z();
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t hx = floor_of(halves * static_cast<double>(ends[0][i]));
    const std::int32_t hy = floor_of(halves * static_cast<double>(ends[1][i]));
    const std::int32_t hz = floor_of(halves * static_cast<double>(ends[2][i]));
    const std::int32_t x = (hx >> 1) - x0, y = (hy >> 1) - y0, z = (hz >> 1) - z0;
    const int inside = static_cast<int>(x >= 0) & static_cast<int>(x < nx) & static_cast<int>(y >= 0) &
                       static_cast<int>(y < ny) & static_cast<int>(z >= 0) & static_cast<int>(z < nz);
    const std::int32_t octant = (hx & 1) | (hy & 1) << 1 | (hz & 1) << 2;
    octants[i] = inside != 0 ? ((z * ny + y) * nx + x) << 3 | octant : -1;
  }
}
FIRSTLOOK_AVX2 void compute_octants_avx2(const GridGeometry& geometry, const float* const ends[3], std::size_t count,
                                         std::int32_t* octants) {
  compute_octants(geometry, ends, count, octants);
}
void compute_octants_portable(const GridGeometry& geometry, const float* const ends[3], std::size_t count,
                              std::int32_t* octants) {
  compute_octants(geometry, ends, count, octants);
}
void end_octants(const GridGeometry& geometry, const RayRow& row, std::span<std::int32_t> octants) {
  const float* const ends[3] = {row.end_x_m.data(), row.end_y_m.data(), row.end_z_m.data()};
  has_avx2() ? compute_octants_avx2(geometry, ends, octants.size(), octants.data())
             : compute_octants_portable(geometry, ends, octants.size(), octants.data());
}

}  // namespace

Inserter::Inserter(const GridGeometry& geometry, const DepthSensor& sensor)
    : geometry_(geometry), rays_(sensor), image_(sensor.intrinsics.width, sensor.intrinsics.height) {
  ENSURE(3021, geometry.resolution_m >= kResolutionMin_m && (geometry.size.array() > 0).all());
  ENSURE(3025, geometry.count() <= std::numeric_limits<std::int32_t>::max() / 8);
  row_reach_m_.resize(static_cast<std::size_t>(sensor.intrinsics.width));
  row_octant_.resize(row_reach_m_.size());
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
    mark_by_voxels(map, depth, base_T_depth, self_depth_m, result);
  else
    mark_by_rays(map, depth, base_T_depth, self_depth_m, result);
  result.change = map.apply(missed_, hit_, base_T_depth, stamp_s);
  note_crossed_octants(map, missed_, hit_, image_, rays_.sensor(), rays_.is_pinhole(), base_T_depth);
  return result;
}

void Inserter::mark_hit(VoxelMap& map, std::int32_t octant) {
  if (octant < 0) return;
  const auto index = static_cast<std::size_t>(octant) >> 3;
  hit_[index >> 6] |= 1ULL << (index & 63);
  map.note_surface(index, static_cast<unsigned>(octant) & 7U);
}

void Inserter::note_reach(int v, const RayRow& row) {
  for (std::size_t u = 0; u < row.kind.size(); ++u) {
    row_reach_m_[u] = row.kind[u] <= PixelKind::kBeyond ? row.reach_m[u] : RangeImage::kNoRay;
  }
  image_.set_row(v, row_reach_m_);
}

void Inserter::mark_by_rays(VoxelMap& map, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                            std::span<const float> self_depth_m, PixelCounts& counts) {
  RayMarker marker(geometry_, base_T_depth.translation().cast<float>(), missed_);
  counts = rays_.for_each_row(depth, base_T_depth, self_depth_m, [&](int v, const RayRow& row) {
    note_reach(v, row);
    end_octants(geometry_, row, row_octant_);
    for (std::size_t u = 0; u < row.kind.size(); ++u) {
      if (row.kind[u] > PixelKind::kBeyond) continue;
      marker.mark_passed({row.end_x_m[u], row.end_y_m[u], row.end_z_m[u]});
      if (row.kind[u] == PixelKind::kHit) mark_hit(map, row_octant_[u]);
    }
  });
}

void Inserter::mark_by_voxels(VoxelMap& map, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                              std::span<const float> self_depth_m, PixelCounts& counts) {
  counts = rays_.for_each_row(depth, base_T_depth, self_depth_m, [&](int v, const RayRow& row) {
    note_reach(v, row);
    end_octants(geometry_, row, row_octant_);
    for (std::size_t u = 0; u < row.kind.size(); ++u) {
      if (row.kind[u] == PixelKind::kHit) mark_hit(map, row_octant_[u]);
    }
  });
  image_.build_levels();
  PassedVoxels(geometry_, rays_, image_, depth, base_T_depth, hit_, missed_).mark();
}

}  // namespace firstlook
