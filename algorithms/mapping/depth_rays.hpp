/// The rays of a depth frame: which pixels count, and where each ends in base coordinates.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/voxel_map.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// A depth sensor's limits (sensor_presets.hpp says where figures come from). Defaults are the Kinect's.
struct DepthSensor {
  CameraIntrinsics intrinsics;
  double range_min_m = 0.5;      ///< along the optical axis; nearer returns are dropped
  double range_max_m = 5.0;      ///< distance from the sensor
  double range_trusted_m = 3.0;  ///< safety rule 9: a return beyond clears up to here and marks nothing
  double baseline_m = 0.075;     ///< to the projector or second camera along +x, whose shadow has no returns; 0: none
};

/// Whether a pose is a rigid motion of finite numbers.
[[nodiscard]] bool is_rigid(const Transform<Base, Depth>& base_T_depth);

/// What became of a frame's pixels.
struct PixelCounts {
  std::uint32_t pixels_used = 0;      ///< rays that ended in a hit
  std::uint32_t pixels_beyond = 0;    ///< rays cut at the maximum range: they clear and mark nothing
  std::uint32_t pixels_empty = 0;     ///< no return, or no ray through the lens: clears nothing
  std::uint32_t pixels_too_near = 0;  ///< nearer than range_min_m: dropped
  std::uint32_t pixels_self = 0;      ///< on the arm's own body: dropped
};

/// What became of a pixel. Only the first two have a ray.
enum class PixelKind : std::uint8_t { kHit, kBeyond, kNoDirection, kEmpty, kSelf, kTooNear };
inline constexpr std::size_t kPixelKinds = 6;
[[nodiscard]] PixelCounts counts_of(const std::array<std::uint32_t, kPixelKinds>& pixels);

/// Where the ray of a pixel ends.
struct RayEnd {
  Eigen::Vector3f end_m = Eigen::Vector3f::Zero();  ///< base coordinates, rounded to float as octomap::point3d is
  float reach_m = 0;                                ///< the end's depth along the optical axis
  bool is_hit = false;                              ///< false: cut at range_m()
};

/// One row of pixels, an array for each quantity. Those of pixels without a ray mean nothing.
struct RayRow {
  std::vector<PixelKind> kind;
  std::vector<float> end_x_m, end_y_m, end_z_m, reach_m;  ///< as in RayEnd
};

/// What is the same for all rays of a frame.
struct RayFrame {
  double units_per_m;
  double rotation[3][3];  // base_R_depth
  double translation_m[3];
  float origin_m[3];
  double range_m;
  float range_squared_m2;  // the largest whose root is within the range
  std::int32_t value_min;  // the first value that is not too near
};

/// The directions of a sensor's pixels; memory is taken at construction.
class DepthRays {
 public:
  explicit DepthRays(const DepthSensor& sensor);
  [[nodiscard]] static std::size_t required_bytes(const DepthSensor& sensor);

  [[nodiscard]] const DepthSensor& sensor() const { return sensor_; }
  /// Where rays are cut: min(range_max_m, range_trusted_m).
  [[nodiscard]] double range_m() const { return range_m_; }
  /// A pinhole image has one direction for each column and row; a distorted one does not.
  [[nodiscard]] bool is_pinhole() const { return !per_pixel_; }

  /// A pixel's ray at depth 1; NaN where the lens model has none.
  [[nodiscard]] Eigen::Vector3d direction(int u, int v) const {
    const auto column = static_cast<std::size_t>(u), row = static_cast<std::size_t>(v);
    const std::size_t pixel = row * static_cast<std::size_t>(sensor_.intrinsics.width) + column;
    return {ray_x_[per_pixel_ ? pixel : column], ray_y_[per_pixel_ ? pixel : row], 1};
  }

  /// Whether a frame can be used at all: size, depth scale, a pose that is a rigid motion, and a self filter that is
  /// empty or has the frame's size. @return kFrameRefused
  [[nodiscard]] Status check(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                             std::span<const float> self_depth_m) const;

  /// Calls visit(v, RayRow) for each row of a frame that passes check().
  template <typename Visit>
  PixelCounts for_each_row(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                           std::span<const float> self_depth_m, Visit visit);
  /// Calls visit(RayEnd) for each ray of such a frame.
  template <typename Visit>
  PixelCounts for_each(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                       std::span<const float> self_depth_m, Visit visit);

  [[nodiscard]] RayFrame frame(double units_per_m, const Transform<Base, Depth>& base_T_depth) const;
  /// The ray of one pixel alone; it must have one.
  [[nodiscard]] RayEnd ray(const RayFrame& frame, const DepthImage& depth, int u, int v) const;

  /// The smallest box around the sensor and all ray ends of a frame that passes check().
  [[nodiscard]] AxisBox bounds(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth);

 private:
  void compute_row(const RayFrame& frame, const DepthImage& depth, std::span<const float> self_depth_m, int v);

  DepthSensor sensor_;
  double range_m_ = 0;
  float range_squared_m2_ = 0;
  bool per_pixel_ = false;     ///< a distorted image has a direction for each pixel
  std::vector<double> ray_x_;  ///< x / z for each column or pixel; NaN where the lens model has no ray
  std::vector<double> ray_y_;  ///< y / z for each row or pixel
  RayRow row_;
  std::vector<double> row_y_, row_z_m_;
  std::vector<float> row_squared_m2_;
};

template <typename Visit>
PixelCounts DepthRays::for_each_row(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                                    std::span<const float> self_depth_m, Visit visit) {
  std::array<std::uint32_t, kPixelKinds> counted{};
  const RayFrame ray_frame = frame(depth.units_per_m, base_T_depth);
  for (int v = 0; v < depth.pixels.height; ++v) {
    compute_row(ray_frame, depth, self_depth_m, v);
    for (std::size_t kind = 0; kind < counted.size(); ++kind)
      counted[kind] += static_cast<std::uint32_t>(std::count(row_.kind.begin(), row_.kind.end(), PixelKind(kind)));
    visit(v, row_);
  }
  return counts_of(counted);
}

template <typename Visit>
PixelCounts DepthRays::for_each(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                                std::span<const float> self_depth_m, Visit visit) {
  return for_each_row(depth, base_T_depth, self_depth_m, [&](int, const RayRow& row) {
    for (std::size_t u = 0; u < row.kind.size(); ++u) {
      if (row.kind[u] > PixelKind::kBeyond) continue;
      visit(RayEnd{{row.end_x_m[u], row.end_y_m[u], row.end_z_m[u]}, row.reach_m[u], row.kind[u] == PixelKind::kHit});
    }
  });
}

}  // namespace firstlook
