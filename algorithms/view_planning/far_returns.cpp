#include "algorithms/view_planning/far_returns.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/view_planning/ray_walk.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr double kCell_m = 0.25;
constexpr double kOpenShare = 0.75;
constexpr int kColumnsMax = 80;  // of the pixels that are looked at: neighbours lie within a cell up to 20 m

}  // namespace

GridGeometry FarReturns::cells_around(const GridGeometry& map, double range_m) {
  const Eigen::Vector3d low = map.first.cast<double>() * map.resolution_m;
  const Eigen::Vector3d high = (map.first + map.size).cast<double>() * map.resolution_m;
  return GridGeometry::covering(low.array() - range_m, high.array() + range_m, kCell_m);
}

FarReturns::FarReturns(const GridGeometry& map, double range_m)
    : cells_(cells_around(map, range_m)),
      low_m_(map.first.cast<double>() * map.resolution_m),
      high_m_((map.first + map.size).cast<double>() * map.resolution_m),
      seen_(cells_.count(), 0),
      range_m_(range_m) {}

std::size_t FarReturns::required_bytes(const GridGeometry& map, double range_m) {
  return cells_around(map, range_m).count();
}

double FarReturns::leaves_map(const Eigen::Vector3d& from_m, const Eigen::Vector3d& way_m) const {
  double leaves = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double side = way_m[axis] > 0 ? high_m_[axis] : low_m_[axis];
    if (way_m[axis] != 0) leaves = std::min(leaves, (side - from_m[axis]) / way_m[axis]);
  }
  return std::max(0.0, leaves);
}

void FarReturns::note_opening(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  const Eigen::Vector3d way = to_m - from_m;
  const double leaves = leaves_map(from_m, way);
  if (leaves >= 1) return;
  walk_ray(cells_, from_m + leaves * way, to_m, [&](std::size_t cell, double) {
    seen_[cell] |= kOpen;
    return true;
  });
  knows_openings_ = true;
}

void FarReturns::learn(const DepthImage& depth, const CameraIntrinsics& camera,
                       const Transform<Base, Depth>& base_T_depth, std::span<const float> self_depth_m) {
  const ImageView<const std::uint16_t>& pixels = depth.pixels;
  ENSURE(4561, pixels.width == camera.width && pixels.height == camera.height && depth.units_per_m > 0);
  ENSURE(4562, self_depth_m.empty() || self_depth_m.size() == pixels.size());
  if (!cells_.contains(cells_.voxel(base_T_depth.translation()))) return;  // no arm reaches there
  const int step = std::max(1, camera.width / kColumnsMax);
  // One pixel without a return says nothing: edges and dark spots have them, too.
  const auto is_hole = [&](int u, int v) {
    return pixels.at(u, v) == 0 && pixels.at(u - step, v) == 0 && pixels.at(u + step, v) == 0 &&
           pixels.at(u, v - step) == 0 && pixels.at(u, v + step) == 0;
  };
  for (int v = step; v < camera.height - step; v += step) {
    for (int u = step; u < camera.width - step; u += step) {
      const auto at =
          static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(u);
      if (!self_depth_m.empty() && std::isfinite(self_depth_m[at])) continue;
      const Eigen::Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
      const double z_m = pixels.at(u, v) / depth.units_per_m;
      if (z_m > 0) {
        const Eigen::Vector3i cell = cells_.voxel(base_T_depth * Eigen::Vector3d(z_m * ray));
        if (!cells_.contains(cell)) continue;
        seen_[cells_.index(cell)] |= kReturned;
        knows_returns_ = true;
      } else if (is_hole(u, v)) {
        note_opening(base_T_depth.translation(), base_T_depth * Eigen::Vector3d(range_m_ * ray.normalized()));
      }
    }
  }
}

bool FarReturns::lies_between(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const {
  const Eigen::Vector3d way = to_m - from_m;
  const double leaves = leaves_map(from_m, way);
  bool found = false;
  if (leaves >= 1) return found;
  walk_ray(cells_, from_m + leaves * way, to_m, [&](std::size_t cell, double) {
    found = (seen_[cell] & kReturned) != 0;
    return !found;
  });
  return found;
}

bool FarReturns::is_open(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const {
  const Eigen::Vector3d way = to_m - from_m;
  const double leaves = leaves_map(from_m, way);
  if (leaves >= 1) return false;
  int crossed = 0, seen_open = 0;
  bool returned = false;
  walk_ray(cells_, from_m + leaves * way, to_m, [&](std::size_t cell, double) {
    returned = (seen_[cell] & kReturned) != 0;
    ++crossed;
    seen_open += seen_[cell] == kOpen ? 1 : 0;
    return !returned;
  });
  return !returned && seen_open > kOpenShare * crossed;
}

}  // namespace firstlook
