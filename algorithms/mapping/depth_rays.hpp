/// The rays of a depth frame: which pixels count, and where each ends in base coordinates.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/voxel_map.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// A depth sensor's limits. Defaults are the Kinect's (the thesis: 0.5 to 5 m, random error growing with z²).
struct DepthSensor {
  CameraIntrinsics intrinsics;
  double range_min_m = 0.5;      ///< along the optical axis; nearer returns are dropped
  double range_max_m = 5.0;      ///< distance from the sensor
  double range_trusted_m = 3.0;  ///< safety rule 9: a return beyond clears up to here and marks nothing
  double noise_at_1m = 0.00285;  ///< standard deviation, m at 1 m; times z²
};

/// What became of a frame's pixels.
struct PixelCounts {
  std::uint32_t pixels_used = 0;      ///< rays that ended in a hit
  std::uint32_t pixels_beyond = 0;    ///< rays cut at the maximum range: they clear and mark nothing
  std::uint32_t pixels_empty = 0;     ///< no return, or no ray through the lens: clears nothing
  std::uint32_t pixels_too_near = 0;  ///< nearer than range_min_m: dropped
  std::uint32_t pixels_self = 0;      ///< on the arm's own body: dropped
};

/// The directions of a sensor's pixels; memory is taken at construction.
class DepthRays {
 public:
  explicit DepthRays(const DepthSensor& sensor);
  [[nodiscard]] static std::size_t required_bytes(const DepthSensor& sensor);

  [[nodiscard]] const DepthSensor& sensor() const { return sensor_; }
  /// Where rays are cut: min(range_max_m, range_trusted_m).
  [[nodiscard]] double range_m() const { return range_m_; }

  /// Whether a frame can be used at all: size, depth scale, a pose that is a rigid motion, and a self filter that is
  /// empty or has the frame's size. @return kFrameRefused
  [[nodiscard]] Status check(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                             std::span<const float> self_depth_m) const;

  /// Calls visit(end_m, is_hit) for each ray of a frame that passes check(): ends in base coordinates, rounded to float
  /// as octomap::point3d is, cut at range_m() (is_hit is false then).
  template <typename Visit>
  PixelCounts for_each(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                       std::span<const float> self_depth_m, Visit visit) const;

  /// The smallest box around the sensor and all ray ends of a frame that passes check().
  [[nodiscard]] AxisBox bounds(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth) const;

 private:
  DepthSensor sensor_;
  double range_m_ = 0;
  bool per_pixel_ = false;     ///< a distorted image has a direction for each pixel
  std::vector<double> ray_x_;  ///< x / z for each column or pixel; NaN where the lens model has no ray
  std::vector<double> ray_y_;  ///< y / z for each row or pixel
};

template <typename Visit>
PixelCounts DepthRays::for_each(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                                std::span<const float> self_depth_m, Visit visit) const {
  const Eigen::Matrix3d rotation = base_T_depth.rotation();
  const Eigen::Vector3d translation_m = base_T_depth.translation();
  const Eigen::Vector3f origin_m = translation_m.cast<float>();
  const auto cut_m = static_cast<float>(range_m_);
  PixelCounts counts;
  std::size_t pixel = 0;
  for (int row = 0; row < depth.pixels.height; ++row) {
    for (int column = 0; column < depth.pixels.width; ++column, ++pixel) {
      const std::uint16_t value = depth.pixels.data[pixel];
      const double x = ray_x_[per_pixel_ ? pixel : static_cast<std::size_t>(column)];
      const double y = ray_y_[per_pixel_ ? pixel : static_cast<std::size_t>(row)];
      if (value == 0 || std::isnan(x)) {
        ++counts.pixels_empty;
        continue;
      }
      const double z_m = value / depth.units_per_m;
      if (!self_depth_m.empty() && z_m >= static_cast<double>(self_depth_m[pixel])) {
        ++counts.pixels_self;
        continue;
      }
      if (z_m < sensor_.range_min_m) {
        ++counts.pixels_too_near;
        continue;
      }
      const Eigen::Vector3f end_m = (rotation * Eigen::Vector3d(x * z_m, y * z_m, z_m) + translation_m).cast<float>();
      const Eigen::Vector3f ray_m = end_m - origin_m;
      const float squared = ray_m.x() * ray_m.x() + ray_m.y() * ray_m.y() + ray_m.z() * ray_m.z();
      const double distance_m = std::sqrt(static_cast<double>(squared));
      if (distance_m <= range_m_) {
        ++counts.pixels_used;
        visit(end_m, true);
        continue;
      }
      ++counts.pixels_beyond;
      // A distance that overflows has no direction left; nothing is cleared then.
      if (!std::isfinite(squared)) continue;
      visit(Eigen::Vector3f(origin_m + ray_m / static_cast<float>(distance_m) * cut_m), false);
    }
  }
  return counts;
}

}  // namespace firstlook
