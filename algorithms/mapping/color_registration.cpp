#include "algorithms/mapping/color_registration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/mapping/ray_marker.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

// Something stands in front when it is nearer than this share of a point's depth. Surfaces pass that are seen within
// 5 degrees of edge-on: 2 px / 525 px * tan(84.5 degrees) = 4 %.
constexpr float kInFrontShare = 0.96F;

/// Two depth pixels wide, as the colour camera sees them.
int cell_side_px(const DepthSensor& sensor, const CameraIntrinsics& camera) {
  const double ratio = std::max(camera.fx / sensor.intrinsics.fx, camera.fy / sensor.intrinsics.fy);
  return std::clamp(static_cast<int>(std::ceil(2 * ratio)), 1, std::max(camera.width, camera.height));
}

int cells(int length_px, int cell_px) { return (length_px + cell_px - 1) / cell_px; }

std::size_t cell_count(const CameraIntrinsics& camera, int cell_px) {
  return static_cast<std::size_t>(cells(camera.width, cell_px)) *
         static_cast<std::size_t>(cells(camera.height, cell_px));
}

}  // namespace

ColorRegistration::ColorRegistration(const GridGeometry& geometry, const DepthSensor& sensor,
                                     const CameraIntrinsics& intrinsics)
    : geometry_(geometry),
      width_(intrinsics.width),
      height_(intrinsics.height),
      rays_(sensor),
      cell_px_(cell_side_px(sensor, intrinsics)),
      columns_(cells(intrinsics.width, cell_px_)),
      nearest_(cell_count(intrinsics, cell_px_)) {
  ENSURE(3142, is_usable(intrinsics));
}

std::size_t ColorRegistration::required_bytes(const DepthSensor& sensor, const CameraIntrinsics& intrinsics) {
  return DepthRays::required_bytes(sensor) + cell_count(intrinsics, cell_side_px(sensor, intrinsics)) * sizeof(float);
}

ColorRegistration::Seen ColorRegistration::see(const ColorSensor& camera, int u, int v, double depth_m) const {
  const Eigen::Vector3d point_m = camera.camera_T_depth * Eigen::Vector3d(depth_m * rays_.direction(u, v));
  const auto pixel = project(camera.intrinsics, point_m);
  if (!pixel || !in_image(camera.intrinsics, *pixel, -0.5)) return {};
  return {std::clamp(static_cast<int>(std::lround(pixel->x())), 0, width_ - 1),
          std::clamp(static_cast<int>(std::lround(pixel->y())), 0, height_ - 1), static_cast<float>(point_m.z())};
}

float& ColorRegistration::nearest(const Seen& seen) {
  const int cell = seen.row / cell_px_ * columns_ + seen.column / cell_px_;
  return nearest_[static_cast<std::size_t>(cell)];
}

void ColorRegistration::find_nearest(const DepthImage& depth, const ColorSensor& camera) {
  std::ranges::fill(nearest_, std::numeric_limits<float>::infinity());
  for (int v = 0; v < depth.pixels.height; ++v) {
    for (int u = 0; u < depth.pixels.width; ++u) {
      const std::uint16_t value = depth.pixels.at(u, v);
      if (value == 0) continue;
      const Seen seen = see(camera, u, v, value / depth.units_per_m);
      if (seen.column >= 0) nearest(seen) = std::min(nearest(seen), seen.depth_m);
    }
  }
}

std::uint32_t ColorRegistration::add(ColorPlane& plane, const DepthImage& depth,
                                     const Transform<Base, Depth>& base_T_depth, std::span<const float> self_depth_m,
                                     const ColorSensor& camera, const ColorImage& colors,
                                     std::span<const std::uint64_t> hit) {
  ENSURE(3143, colors.width == width_ && colors.height == height_);
  ENSURE(3144, camera.intrinsics.width == width_ && camera.intrinsics.height == height_);
  find_nearest(depth, camera);
  std::uint32_t points = 0;
  rays_.for_each_row(depth, base_T_depth, self_depth_m, [&](int v, const RayRow& row) {
    for (int u = 0; u < depth.pixels.width; ++u) {
      const auto i = static_cast<std::size_t>(u);
      if (row.kind[i] != PixelKind::kHit) continue;
      const Eigen::Vector3i voxel = octomap_voxel(geometry_, {row.end_x_m[i], row.end_y_m[i], row.end_z_m[i]});
      if (!geometry_.contains(voxel)) continue;
      const std::size_t index = geometry_.index(voxel);
      if ((hit[index >> 6] >> (index & 63) & 1U) == 0) continue;
      const Seen seen = see(camera, u, v, depth.pixels.at(u, v) / depth.units_per_m);
      if (seen.column < 0 || nearest(seen) < kInFrontShare * seen.depth_m) continue;
      plane.add(index, colors.at(seen.column, seen.row));
      ++points;
    }
  });
  return points;
}

}  // namespace firstlook
