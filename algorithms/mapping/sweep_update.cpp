#include "algorithms/mapping/sweep_update.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "algorithms/mapping/depth_rays.hpp"
#include "algorithms/mapping/octants.hpp"
#include "algorithms/mapping/ray_marker.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr double kKeysMax = 32768;  // OctoMap's keys reach this far from zero

}  // namespace

SweepUpdate::SweepUpdate(const GridGeometry& geometry, const ScannerLimits& limits)
    : geometry_(geometry), limits_(limits) {
  ENSURE(3123, limits.range_min_m >= 0 && limits.range_trusted_m > limits.range_min_m);
  missed_.resize(VoxelMap::bit_words(geometry));
  hit_.resize(missed_.size());
  crossed_.resize(geometry.count());
  surface_.resize(geometry.count());
}

std::size_t SweepUpdate::required_bytes(const GridGeometry& geometry) {
  return 2 * VoxelMap::bit_words(geometry) * sizeof(std::uint64_t) + 2 * geometry.count();
}

void SweepUpdate::begin() {
  std::ranges::fill(missed_, 0);
  std::ranges::fill(hit_, 0);
  std::ranges::fill(crossed_, 0);
  std::ranges::fill(surface_, 0);
}

Status SweepUpdate::add(const ScanLine& line) {
  if (!is_rigid(line.base_T_scanner)) return failure(Fault::kFrameRefused, "the line's pose is not a rigid motion");
  const double bound_m = kKeysMax * geometry_.resolution_m - limits_.range_trusted_m - 1;
  if (line.base_T_scanner.translation().cwiseAbs().maxCoeff() > bound_m)
    return failure(Fault::kFrameRefused, "the line's pose is more than {} m away", bound_m);
  if (!std::isfinite(line.angle_first_rad) || !std::isfinite(line.angle_step_rad))
    return failure(Fault::kFrameRefused, "the line's angles are not finite");
  const Eigen::Vector3d from_m = line.base_T_scanner.translation();
  RayMarker marker(geometry_, from_m.cast<float>(), missed_);
  for (std::size_t i = 0; i < line.ranges_m.size(); ++i) {
    const auto range_m = static_cast<double>(line.ranges_m[i]);
    if (!std::isfinite(range_m) || range_m <= 0 || range_m < limits_.range_min_m) continue;
    const double angle_rad = line.angle_first_rad + line.angle_step_rad * static_cast<double>(i);
    const bool is_hit = range_m <= limits_.range_trusted_m;
    const double reach_m = std::min(range_m, limits_.range_trusted_m);
    const Eigen::Vector3f end_m =
        (line.base_T_scanner * Eigen::Vector3d(reach_m * std::sin(angle_rad), 0, reach_m * std::cos(angle_rad)))
            .cast<float>();
    marker.mark_passed(end_m);
    mark_crossed(from_m, end_m.cast<double>());
    const Eigen::Vector3i voxel = octomap_voxel(geometry_, end_m);
    if (!is_hit || !geometry_.contains(voxel)) continue;
    const std::size_t index = geometry_.index(voxel);
    hit_[index >> 6] |= 1ULL << (index & 63);
    surface_[index] = static_cast<std::uint8_t>(surface_[index] | 1U << octant_of(geometry_, end_m));
  }
  return {};
}

/// As note_crossed_octants() asks of a frame: the ray meets the ball inscribed in the octant and ends beyond it.
void SweepUpdate::mark_crossed(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  const double octant_m = geometry_.resolution_m / 2, ball_m = octant_m / 2;
  const double length_m = (to_m - from_m).norm();
  if (length_m == 0) return;
  const Eigen::Vector3d along = (to_m - from_m) / length_m;
  const double beyond_m = octant_m * std::sqrt(3.0) / 2;
  const double last_m = length_m - beyond_m;
  // Steps of the ball's radius: a chord through an octant that comes near its middle is not stepped over.
  for (double at_m = beyond_m; at_m < last_m; at_m += ball_m) {
    const Eigen::Vector3d point_m = from_m + at_m * along;
    const Eigen::Vector3i voxel = geometry_.voxel(point_m);
    if (!geometry_.contains(voxel)) continue;
    const unsigned octant = octant_of(geometry_, point_m.cast<float>());
    const Eigen::Vector3d corner((octant & 1) != 0 ? 1 : -1, (octant & 2) != 0 ? 1 : -1, (octant & 4) != 0 ? 1 : -1);
    const Eigen::Vector3d middle_m = geometry_.center_m(voxel) + corner * (octant_m / 2);
    const double middle_at_m = (middle_m - from_m).dot(along);
    if ((middle_m - from_m - middle_at_m * along).norm() > ball_m || middle_at_m > last_m) continue;
    std::uint8_t& crossed = crossed_[geometry_.index(voxel)];
    crossed = static_cast<std::uint8_t>(crossed | 1U << octant);
  }
}

FrameChange SweepUpdate::apply(VoxelMap& map, const Transform<Base, Depth>& base_T_scanner, double stamp_s) {
  ENSURE(3092, map.geometry() == geometry_);
  for (std::size_t i = 0; i < surface_.size(); ++i) {
    for (unsigned rest = surface_[i]; rest != 0; rest &= rest - 1)
      map.note_surface(i, static_cast<unsigned>(std::countr_zero(rest)));
  }
  const FrameChange change = map.apply(missed_, hit_, base_T_scanner, stamp_s);
  for (std::size_t word = 0; word < missed_.size(); ++word) {
    for (std::uint64_t bits = missed_[word] & ~hit_[word]; bits != 0; bits &= bits - 1) {
      const std::size_t index = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      map.note_crossed(index, crossed_[index]);
    }
  }
  begin();
  return change;
}

}  // namespace firstlook
