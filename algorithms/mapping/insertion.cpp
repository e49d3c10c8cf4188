#include "algorithms/mapping/insertion.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/mapping/ray_marker.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr double kKeysMax = 32768;            // OctoMap's keys reach this far from zero
constexpr double kStampMax_s = 4294967294.0;  // the map keeps whole seconds in 32 bits
constexpr double kResolutionMin_m = 0.001;    // float points resolve it to a thousandth within 5 m

}  // namespace

Inserter::Inserter(const GridGeometry& geometry, const DepthSensor& sensor) : geometry_(geometry), rays_(sensor) {
  ENSURE(3021, geometry.resolution_m >= kResolutionMin_m && (geometry.size.array() > 0).all());
  missed_.assign(VoxelMap::bit_words(geometry), 0);
  hit_.assign(VoxelMap::bit_words(geometry), 0);
}

std::size_t Inserter::required_bytes(const GridGeometry& geometry, const DepthSensor& sensor) {
  return 2 * VoxelMap::bit_words(geometry) * sizeof(std::uint64_t) + DepthRays::required_bytes(sensor);
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
  RayMarker marker(geometry_, base_T_depth.translation().cast<float>(), missed_);
  InsertionResult result;
  const auto trace = [&](const Eigen::Vector3f& end_m, bool is_hit) {
    marker.mark_passed(end_m);
    if (!is_hit) return;
    const Eigen::Vector3i voxel = octomap_voxel(geometry_, end_m);
    if (!geometry_.contains(voxel)) return;
    const std::size_t index = geometry_.index(voxel);
    hit_[index >> 6] |= 1ULL << (index & 63);
  };
  static_cast<PixelCounts&>(result) = rays_.for_each(depth, base_T_depth, self_depth_m, trace);
  result.change = map.apply(missed_, hit_, base_T_depth, stamp_s);
  return result;
}

}  // namespace firstlook
