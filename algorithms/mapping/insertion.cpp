#include "algorithms/mapping/insertion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/mapping/octants.hpp"
#include "algorithms/mapping/passed_voxels.hpp"
#include "algorithms/mapping/ray_marker.hpp"
#include "platform/core/ensure.hpp"
#include "platform/core/fixed_vector.hpp"
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

/// Leaves the reach of pixels that have a ray, and the octants of those that have a hit.
[[gnu::always_inline]] inline void keep_rays(const RayRow& row, std::int32_t* __restrict octants,
                                             float* __restrict reach_m) {
  const PixelKind* kind = row.kind.data();
  const float* reach = row.reach_m.data();
  for (std::size_t u = 0; u < row.kind.size(); ++u) {
    reach_m[u] = static_cast<std::int32_t>(kind[u]) <= static_cast<std::int32_t>(PixelKind::kBeyond)
                     ? reach[u]
                     : RangeImage::kNoRay;
    octants[u] = kind[u] == PixelKind::kHit ? octants[u] : -1;
  }
}
FIRSTLOOK_AVX2 void keep_rays_avx2(const RayRow& row, std::int32_t* octants, float* reach_m) {
  keep_rays(row, octants, reach_m);
}
void keep_rays_portable(const RayRow& row, std::int32_t* octants, float* reach_m) { keep_rays(row, octants, reach_m); }

/// Rays that are cut only where OctoMap's keys end.
DepthSensor without_range(DepthSensor sensor, double resolution_m) {
  sensor.range_max_m = sensor.range_trusted_m = kKeysMax * resolution_m;
  return sensor;
}

}  // namespace

Inserter::Inserter(const GridGeometry& geometry, const DepthSensor& sensor, RayEnds ends)
    : geometry_(geometry),
      sensor_(sensor),
      ends_(ends),
      range_m_(std::min(sensor.range_max_m, sensor.range_trusted_m)),
      rays_(ends == RayEnds::kPixels ? sensor : without_range(sensor, geometry.resolution_m)),
      end_octants_(geometry, sensor),
      image_(sensor.intrinsics.width, sensor.intrinsics.height) {
  ENSURE(3021, geometry.resolution_m >= kResolutionMin_m && (geometry.size.array() > 0).all());
  ENSURE(3025, geometry.count() <= std::numeric_limits<std::int32_t>::max() / 8);
  ENSURE(3026, range_m_ > 0);
  row_reach_m_.resize(static_cast<std::size_t>(sensor.intrinsics.width));
  row_octant_.resize(row_reach_m_.size());
  missed_.assign(VoxelMap::bit_words(geometry), 0);
  hit_.assign(VoxelMap::bit_words(geometry), 0);
  if (ends == RayEnds::kVoxelCenters) beyond_.assign(VoxelMap::bit_words(geometry), 0);
}

std::size_t Inserter::required_bytes(const GridGeometry& geometry, const DepthSensor& sensor, RayEnds ends) {
  const std::size_t planes = ends == RayEnds::kPixels ? 2 : 3;
  return planes * VoxelMap::bit_words(geometry) * sizeof(std::uint64_t) + DepthRays::required_bytes(sensor) +
         EndOctants::required_bytes(sensor) +
         RangeImage::required_bytes(sensor.intrinsics.width, sensor.intrinsics.height) +
         static_cast<std::size_t>(sensor.intrinsics.width) * (sizeof(float) + sizeof(std::int32_t));
}

Status Inserter::check_place(const Transform<Base, Depth>& base_T_depth, double stamp_s) const {
  if (!(stamp_s >= 0 && stamp_s < kStampMax_s)) return failure(Fault::kFrameRefused, "time stamp {} s", stamp_s);
  const double bound_m = kKeysMax * geometry_.resolution_m - range_m_ - 1;
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
  if (ends_ == RayEnds::kVoxelCenters)
    mark_discretized(map, depth, base_T_depth, self_depth_m, result);
  else if (rays_.is_pinhole() && depth.units_per_m >= EndOctants::kUnitsPerMeterMin)
    mark_by_voxels(map, depth, base_T_depth, self_depth_m, result);
  else
    mark_by_rays(map, depth, base_T_depth, self_depth_m, result);
  result.change = map.apply(missed_, hit_, base_T_depth, stamp_s);
  note_crossed_octants(map, missed_, hit_, image_, sensor_, rays_.is_pinhole(), base_T_depth);
  return result;
}

void Inserter::set_ground(const GroundPlane& ground) {
  ENSURE(3127, ends_ == RayEnds::kPixels && std::isfinite(ground.height_m) && ground.tolerance_m > 0);
  ground_ = ground;
}

void Inserter::drop_ground(const RayRow& row) {
  const auto low_m = static_cast<float>(ground_->height_m - ground_->tolerance_m);
  const auto top_m = static_cast<float>(ground_->top_m());
  for (std::size_t u = 0; u < row_octant_.size(); ++u) {
    if (row.end_z_m[u] >= low_m && row.end_z_m[u] <= top_m) row_octant_[u] = -1;
  }
}

void Inserter::mark_hit(VoxelMap& map, std::int32_t octant) {
  if (octant < 0) return;
  const auto index = static_cast<std::size_t>(octant) >> 3;
  hit_[index >> 6] |= 1ULL << (index & 63);
  map.note_surface(index, static_cast<unsigned>(octant) & 7U);
}

void Inserter::note_row(VoxelMap& map, int v, const RayRow& row) {
  end_octants(geometry_, row, row_octant_);
  (has_avx2() ? keep_rays_avx2 : keep_rays_portable)(row, row_octant_.data(), row_reach_m_.data());
  if (ground_) drop_ground(row);
  image_.set_row(v, row_reach_m_);
  std::int32_t before = -1;  // neighbours often end in one place
  for (const std::int32_t octant : row_octant_) {
    if (octant != before) mark_hit(map, octant);
    before = octant;
  }
}

void Inserter::mark_by_rays(VoxelMap& map, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                            std::span<const float> self_depth_m, PixelCounts& counts) {
  RayMarker marker(geometry_, base_T_depth.translation().cast<float>(), missed_);
  counts = rays_.for_each_row(depth, base_T_depth, self_depth_m, [&](int v, const RayRow& row) {
    note_row(map, v, row);
    for (std::size_t u = 0; u < row.kind.size(); ++u) {
      if (row.kind[u] <= PixelKind::kBeyond) marker.mark_passed({row.end_x_m[u], row.end_y_m[u], row.end_z_m[u]});
    }
  });
}

void Inserter::mark_by_voxels(VoxelMap& map, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                              std::span<const float> self_depth_m, PixelCounts& counts) {
  const auto mark_hits = [&](std::span<const std::int32_t> octants) {
    for (const std::int32_t octant : octants) mark_hit(map, octant);
  };
  if (ground_) {  // asks for each end's height
    counts =
        rays_.for_each_row(depth, base_T_depth, self_depth_m, [&](int v, const RayRow& row) { note_row(map, v, row); });
  } else {
    counts = end_octants_.find(rays_, depth, base_T_depth, self_depth_m, image_, mark_hits);
  }
  image_.build_levels();
  mark_passed_voxels(geometry_, rays_, image_, depth, base_T_depth, hit_, missed_);
}

/// The rays of a frame to voxel centres, each walked once.
class Inserter::DistinctEnds {
 public:
  DistinctEnds(Inserter& inserter, const Eigen::Vector3f& origin_m)
      : inserter_(inserter), origin_m_(origin_m), marker_(inserter.geometry_, origin_m, inserter.missed_) {}

  /// @return whether the centre of its voxel is within the range
  bool add(const Eigen::Vector3f& end_m, std::int32_t octant) {
    const GridGeometry& g = inserter_.geometry_;
    if (octant < 0) {  // outside the grid; few, so only neighbours are looked at
      const Eigen::Vector3i voxel = octomap_voxel(g, end_m);
      if (voxel == before_outside_) return is_within_;
      before_outside_ = voxel;
      return is_within_ = cast(voxel);
    }
    const auto index = static_cast<std::size_t>(octant) >> 3;
    const std::uint64_t bit = 1ULL << (index & 63);
    if ((inserter_.hit_[index >> 6] & bit) != 0) return true;
    if ((inserter_.beyond_[index >> 6] & bit) != 0) return false;
    const bool within = cast(octomap_voxel(g, end_m));
    (within ? inserter_.hit_ : inserter_.beyond_)[index >> 6] |= bit;
    return within;
  }
  void finish() {
    marker_.mark_all_passed({ends_m_.begin(), ends_m_.size()});
    ends_m_.clear();
  }

 private:
  /// OctoMap's range test and cut, in its floats.
  bool cast(const Eigen::Vector3i& voxel) {
    if (ends_m_.full()) finish();
    const Eigen::Vector3f center_m = inserter_.geometry_.center_m(voxel).cast<float>();
    const Eigen::Vector3f way_m = center_m - origin_m_;
    const double distance_m =
        std::sqrt(static_cast<double>(way_m.x() * way_m.x() + way_m.y() * way_m.y() + way_m.z() * way_m.z()));
    const bool within = distance_m <= inserter_.range_m_;
    const auto length_m = static_cast<float>(distance_m), cut_m = static_cast<float>(inserter_.range_m_);
    Eigen::Vector3f end_m = center_m;
    for (int axis = 0; axis < 3 && !within; ++axis) end_m[axis] = origin_m_[axis] + way_m[axis] / length_m * cut_m;
    ends_m_.push_back(end_m);
    return within;
  }

  Inserter& inserter_;
  Eigen::Vector3f origin_m_;
  RayMarker marker_;
  FixedVector<Eigen::Vector3f, 64> ends_m_;  // not walked yet
  Eigen::Vector3i before_outside_ = Eigen::Vector3i::Constant(std::numeric_limits<int>::max());
  bool is_within_ = false;
};

void Inserter::mark_discretized(VoxelMap& map, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                                std::span<const float> self_depth_m, PixelCounts& counts) {
  std::fill(beyond_.begin(), beyond_.end(), 0);
  const Eigen::Vector3f origin_m = base_T_depth.translation().cast<float>();
  const auto keys_m = static_cast<float>((kKeysMax - 1) * geometry_.resolution_m);
  DistinctEnds ends(*this, origin_m);
  std::uint32_t beyond = 0;
  counts = rays_.for_each_row(depth, base_T_depth, self_depth_m, [&](int v, const RayRow& row) {
    end_octants(geometry_, row, row_octant_);
    std::fill(row_reach_m_.begin(), row_reach_m_.end(), RangeImage::kNoRay);
    for (std::size_t u = 0; u < row.kind.size(); ++u) {
      if (row.kind[u] != PixelKind::kHit) continue;
      const Eigen::Vector3f end_m(row.end_x_m[u], row.end_y_m[u], row.end_z_m[u]);
      if (end_m.cwiseAbs().maxCoeff() > keys_m) continue;  // no voxel of OctoMap's
      const bool within = ends.add(end_m, row_octant_[u]);
      beyond += within ? 0 : 1;
      const float way_m = (end_m - origin_m).norm(), range_m = static_cast<float>(range_m_);
      row_reach_m_[u] = way_m <= range_m ? row.reach_m[u] : row.reach_m[u] * (range_m / way_m);
      if (within && row_octant_[u] >= 0)
        map.note_surface(static_cast<std::size_t>(row_octant_[u]) >> 3, static_cast<unsigned>(row_octant_[u]) & 7U);
    }
    image_.set_row(v, row_reach_m_);
  });
  ends.finish();
  counts.pixels_used -= beyond;
  counts.pixels_beyond += beyond;
}

}  // namespace firstlook
