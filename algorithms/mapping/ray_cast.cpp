#include "algorithms/mapping/ray_cast.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

// A ray as origin + t * direction with t from 0 to 1, in voxels of the grid.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
};

// The part of a ray inside the grid; empty when from >= to.
struct Interval {
  double from = 0;
  double to = 1;
};

Interval clip(const Ray& ray, const Eigen::Vector3i& size) {
  Interval inside;
  for (int axis = 0; axis < 3; ++axis) {
    const double o = ray.origin[axis], d = ray.direction[axis];
    if (d == 0) {
      if (o < 0 || o >= size[axis]) return {1, 0};
      continue;
    }
    const double a = -o / d, b = (size[axis] - o) / d;
    inside.from = std::max(inside.from, std::min(a, b));
    inside.to = std::min(inside.to, std::max(a, b));
  }
  return inside;
}

// One step for each voxel (Amanatides and Woo 1987). `visit` gets the voxel's index and the t where the ray leaves it,
// and returns false to stop.
template <typename Visit>
void walk(const Ray& ray, const GridGeometry& geometry, Visit visit) {
  const Interval inside = clip(ray, geometry.size);
  if (!(inside.from < inside.to)) return;
  const Eigen::Vector3d entry = ray.origin + inside.from * ray.direction;
  const std::array<std::ptrdiff_t, 3> stride = {1, geometry.size.x(),
                                                static_cast<std::ptrdiff_t>(geometry.size.x()) * geometry.size.y()};
  std::array<double, 3> next{}, delta{};
  std::array<std::ptrdiff_t, 3> step{};
  std::array<int, 3> left{};  // voxels between this one and the grid's face ahead
  std::ptrdiff_t index = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const double d = ray.direction[axis];
    const int at = std::clamp(static_cast<int>(std::floor(entry[axis])), 0, geometry.size[axis] - 1);
    index += at * stride[i];
    next[i] = delta[i] = std::numeric_limits<double>::infinity();
    if (d == 0) continue;
    next[i] = ((d > 0 ? at + 1 : at) - ray.origin[axis]) / d;
    delta[i] = 1 / std::abs(d);
    step[i] = d > 0 ? stride[i] : -stride[i];
    left[i] = d > 0 ? geometry.size[axis] - 1 - at : at;
  }
  while (true) {
    const std::size_t axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    if (!visit(static_cast<std::size_t>(index), next[axis])) return;
    if (next[axis] >= inside.to || left[axis] == 0) return;
    next[axis] += delta[axis];
    index += step[axis];
    --left[axis];
  }
}

}  // namespace

GainRays GainRays::thesis() {
  constexpr int kColumns = 108, kRows = 78;
  constexpr double kPlane_m = 5.0, kWidth_m = 5.4296, kHeight_m = 3.9391;
  GainRays rays;
  for (int row = 0; row < kRows; ++row)
    for (int column = 0; column < kColumns; ++column)
      rays.ends_m.emplace_back(((column + 0.5) / kColumns - 0.5) * kWidth_m, ((row + 0.5) / kRows - 0.5) * kHeight_m,
                               kPlane_m);
  return rays;
}

GainRays GainRays::pinhole(const CameraIntrinsics& c, int columns, int rows, double range_max_m) {
  ENSURE(3031, columns > 0 && rows > 0 && c.fx > 0 && c.fy > 0 && range_max_m > 0);
  GainRays rays;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      // Pixel centres are integers, so the image spans -0.5 .. width - 0.5.
      const double u = (column + 0.5) * c.width / columns - 0.5, v = (row + 0.5) * c.height / rows - 0.5;
      rays.ends_m.push_back(Eigen::Vector3d((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1).normalized() * range_max_m);
    }
  }
  return rays;
}

void build_gain_plane(const VoxelMap& map, std::span<const std::uint8_t> weights, std::span<std::uint8_t> plane) {
  ENSURE(3032, plane.size() == map.size() && (weights.empty() || weights.size() == map.size()));
  for (std::size_t i = 0; i < plane.size(); ++i) {
    switch (map.voxel_class(i)) {
      case VoxelClass::kFree:
        plane[i] = 0;
        break;
      case VoxelClass::kOccupied:
        plane[i] = kOpaque;
        break;
      case VoxelClass::kUnknown: {
        const std::uint8_t weight = weights.empty() ? std::uint8_t{1} : weights[i];
        plane[i] = weight == 0 ? kUnknownNoWeight : std::min(weight, kGainWeightMax);
        break;
      }
    }
  }
}

GainScratch::GainScratch(const GridGeometry& geometry) : epoch_of_(geometry.count(), 0) {}

void GainScratch::begin() {
  if (++epoch_ != 0) return;
  std::fill(epoch_of_.begin(), epoch_of_.end(), std::uint8_t{0});  // marks of 256 views ago would count as this view's
  epoch_ = 1;
}

GainCount count_unknown(const GridGeometry& geometry, std::span<const std::uint8_t> plane, const GainRays& rays,
                        const Transform<Base, Depth>& base_T_depth, double range_min_m, UnknownReading reading,
                        GainScratch& scratch) {
  ENSURE(3033, plane.size() == geometry.count());
  ENSURE(3034, base_T_depth.pose().matrix().allFinite());
  const Eigen::Matrix3d rotation = base_T_depth.rotation() / geometry.resolution_m;
  Ray ray;
  ray.origin = base_T_depth.translation() / geometry.resolution_m - geometry.first.cast<double>();
  GainCount count;
  scratch.begin();
  for (const Eigen::Vector3d& end_m : rays.ends_m) {
    ray.direction = rotation * end_m;
    const double t_min = range_min_m / end_m.z();
    walk(ray, geometry, [&](std::size_t index, double t_leave) {
      const std::uint8_t what = plane[index];
      if (what == 0) return true;
      if (what == kOpaque) return false;
      if (what != kUnknownNoWeight && t_leave > t_min && scratch.mark(index)) {
        ++count.voxels;
        count.weight += what;
      }
      return reading == UnknownReading::kSeeThrough;
    });
  }
  return count;
}

}  // namespace firstlook
