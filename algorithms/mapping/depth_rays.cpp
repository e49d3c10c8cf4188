#include "algorithms/mapping/depth_rays.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include "algorithms/vision/camera_model.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr double kRotationTolerance = 1e-6;  // how far R^T R may be from the identity

// Stands for the ray of a pixel that the lens model does not reach.
constexpr double kNoRay = std::numeric_limits<double>::quiet_NaN();

bool distorted(const CameraIntrinsics& c) { return c.k1 != 0 || c.k2 != 0 || c.p1 != 0 || c.p2 != 0 || c.k3 != 0; }

bool rigid(const Pose& pose) {
  const Eigen::Matrix3d rotation = pose.linear();
  const Eigen::Matrix3d error = rotation.transpose() * rotation - Eigen::Matrix3d::Identity();
  return pose.matrix().allFinite() && rotation.determinant() > 0 && error.cwiseAbs().maxCoeff() <= kRotationTolerance;
}

}  // namespace

DepthRays::DepthRays(const DepthSensor& sensor)
    : sensor_(sensor),
      range_m_(std::min(sensor.range_max_m, sensor.range_trusted_m)),
      per_pixel_(distorted(sensor.intrinsics)) {
  const CameraIntrinsics& c = sensor.intrinsics;
  ENSURE(3022, c.width > 0 && c.height > 0 && c.fx > 0 && c.fy > 0 && std::isfinite(c.cx) && std::isfinite(c.cy));
  ENSURE(3023, range_m_ > 0 && std::isfinite(range_m_) && sensor.range_min_m >= 0);
  if (!per_pixel_) {
    for (int u = 0; u < c.width; ++u) ray_x_.push_back((u - c.cx) / c.fx);
    for (int v = 0; v < c.height; ++v) ray_y_.push_back((v - c.cy) / c.fy);
    return;
  }
  for (int v = 0; v < c.height; ++v) {
    for (int u = 0; u < c.width; ++u) {
      const std::optional<Eigen::Vector2d> ray = undistort(c, {u, v});
      ray_x_.push_back(ray ? ray->x() : kNoRay);
      ray_y_.push_back(ray ? ray->y() : kNoRay);
    }
  }
}

std::size_t DepthRays::required_bytes(const DepthSensor& sensor) {
  const auto width = static_cast<std::size_t>(sensor.intrinsics.width);
  const auto height = static_cast<std::size_t>(sensor.intrinsics.height);
  return (distorted(sensor.intrinsics) ? 2 * width * height : width + height) * sizeof(double);
}

Status DepthRays::check(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                        std::span<const float> self_depth_m) const {
  const CameraIntrinsics& c = sensor_.intrinsics;
  if (depth.pixels.data == nullptr || depth.pixels.width != c.width || depth.pixels.height != c.height)
    return failure(Fault::kFrameRefused, "{} x {} pixels instead of {} x {}", depth.pixels.width, depth.pixels.height,
                   c.width, c.height);
  if (!self_depth_m.empty() && self_depth_m.size() != depth.pixels.size())
    return failure(Fault::kFrameRefused, "self filter of {} pixels for a frame of {}", self_depth_m.size(),
                   depth.pixels.size());
  if (!(depth.units_per_m > 0) || !std::isfinite(depth.units_per_m))
    return failure(Fault::kFrameRefused, "depth scale {} is not a positive number", depth.units_per_m);
  if (!rigid(base_T_depth.pose())) return failure(Fault::kFrameRefused, "its pose is not a rigid motion");
  return {};
}

AxisBox DepthRays::bounds(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth) const {
  const Eigen::Vector3f origin_m = base_T_depth.translation().cast<float>();
  Eigen::Vector3f low_m = origin_m, high_m = origin_m;
  for_each(depth, base_T_depth, {}, [&](const Eigen::Vector3f& end_m, bool) {
    low_m = low_m.cwiseMin(end_m);
    high_m = high_m.cwiseMax(end_m);
  });
  return {low_m.cast<double>(), high_m.cast<double>()};
}

}  // namespace firstlook
