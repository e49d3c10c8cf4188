#include "algorithms/mapping/depth_rays.hpp"

#include <algorithm>
#include <limits>
#include <optional>

#include "algorithms/vision/camera_model.hpp"
#include "platform/core/ensure.hpp"
#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

constexpr double kRotationTolerance = 1e-6;  // how far R^T R may be from the identity

// Stands for the ray of a pixel that the lens model does not reach.
constexpr double kNoRay = std::numeric_limits<double>::quiet_NaN();

bool distorted(const CameraIntrinsics& c) { return c.k1 != 0 || c.k2 != 0 || c.p1 != 0 || c.p2 != 0 || c.k3 != 0; }

/// A row of pixels as plain arrays: what the loops below need to be vectorised.
struct RowArrays {
  int width;
  const std::uint16_t* value;
  const double* x;  // slopes of the rays
  const double* y;
  double* z_m;
  double* distance_m;
  float* end_m[3];
  float* reach_m;
};
struct RowFrame {
  double units_per_m;
  double rotation[3][3];
  double translation_m[3];
  float origin_m[3];
  double range_m;
};

/// Ends of the rays, with or without a return; `end_m` is where the ray is cut when it is longer than the range.
[[gnu::always_inline]] inline void compute_ends(const RowArrays& a, const RowFrame& f) {
  for (int c = 0; c < a.width; ++c) a.z_m[c] = static_cast<double>(a.value[c]) / f.units_per_m;
  for (int axis = 0; axis < 3; ++axis) {
    const double rx = f.rotation[axis][0], ry = f.rotation[axis][1], rz = f.rotation[axis][2];
    const double t = f.translation_m[axis];
    float* __restrict end = a.end_m[axis];
    for (int c = 0; c < a.width; ++c) {
      const double z = a.z_m[c];
      end[c] = static_cast<float>(rx * (a.x[c] * z) + ry * (a.y[c] * z) + rz * z + t);
    }
  }
  const float ox = f.origin_m[0], oy = f.origin_m[1], oz = f.origin_m[2];
  for (int c = 0; c < a.width; ++c) {
    const float x = a.end_m[0][c] - ox, y = a.end_m[1][c] - oy, z = a.end_m[2][c] - oz;
    a.distance_m[c] = std::sqrt(static_cast<double>(x * x + y * y + z * z));
  }
  const auto cut = static_cast<float>(f.range_m);
  for (int axis = 0; axis < 3; ++axis) {
    const float origin = f.origin_m[axis];
    float* __restrict end = a.end_m[axis];
    for (int c = 0; c < a.width; ++c) {
      const float cut_end = origin + (end[c] - origin) / static_cast<float>(a.distance_m[c]) * cut;
      end[c] = a.distance_m[c] <= f.range_m ? end[c] : cut_end;
    }
  }
  for (int c = 0; c < a.width; ++c) {
    const double cut_z = a.z_m[c] * (f.range_m / a.distance_m[c]);
    a.reach_m[c] = static_cast<float>(a.distance_m[c] <= f.range_m ? a.z_m[c] : cut_z);
  }
}
// The same instructions in the same order, several pixels at a time where the processor can: the same bits.
FIRSTLOOK_AVX2 void compute_ends_avx2(const RowArrays& a, const RowFrame& f) { compute_ends(a, f); }
void compute_ends_portable(const RowArrays& a, const RowFrame& f) { compute_ends(a, f); }

}  // namespace

bool is_rigid(const Transform<Base, Depth>& base_T_depth) {
  const Eigen::Matrix3d rotation = base_T_depth.pose().linear();
  const Eigen::Matrix3d error = rotation.transpose() * rotation - Eigen::Matrix3d::Identity();
  return base_T_depth.pose().matrix().allFinite() && rotation.determinant() > 0 &&
         error.cwiseAbs().maxCoeff() <= kRotationTolerance;
}

DepthRays::DepthRays(const DepthSensor& sensor)
    : sensor_(sensor),
      range_m_(std::min(sensor.range_max_m, sensor.range_trusted_m)),
      per_pixel_(distorted(sensor.intrinsics)) {
  const CameraIntrinsics& c = sensor.intrinsics;
  ENSURE(3022, c.width > 0 && c.height > 0 && c.fx > 0 && c.fy > 0 && std::isfinite(c.cx) && std::isfinite(c.cy));
  const auto width = static_cast<std::size_t>(c.width);
  for (auto* doubles : {&row_y_, &row_z_m_, &row_distance_m_}) doubles->resize(width);
  for (auto* floats : {&row_.end_x_m, &row_.end_y_m, &row_.end_z_m, &row_.reach_m}) floats->resize(width);
  row_.kind.resize(width);
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
  const std::size_t row = width * (3 * sizeof(double) + 4 * sizeof(float) + 1);
  return (distorted(sensor.intrinsics) ? 2 * width * height : width + height) * sizeof(double) + row;
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
  if (!is_rigid(base_T_depth)) return failure(Fault::kFrameRefused, "its pose is not a rigid motion");
  return {};
}

AxisBox DepthRays::bounds(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth) {
  const Eigen::Vector3f origin_m = base_T_depth.translation().cast<float>();
  Eigen::Vector3f low_m = origin_m, high_m = origin_m;
  for_each(depth, base_T_depth, {}, [&](const RayEnd& ray) {
    low_m = low_m.cwiseMin(ray.end_m);
    high_m = high_m.cwiseMax(ray.end_m);
  });
  return {low_m.cast<double>(), high_m.cast<double>()};
}

RayEnd DepthRays::ray(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth, int u, int v) {
  compute_row(depth, base_T_depth, {}, v);
  const auto i = static_cast<std::size_t>(u);
  return {{row_.end_x_m[i], row_.end_y_m[i], row_.end_z_m[i]}, row_.reach_m[i], row_.kind[i] == PixelKind::kHit};
}

void DepthRays::compute_row(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                            std::span<const float> self_depth_m, int v) {
  const auto width = static_cast<std::size_t>(depth.pixels.width);
  const std::size_t first = static_cast<std::size_t>(v) * width;
  if (!per_pixel_) std::fill(row_y_.begin(), row_y_.end(), ray_y_[static_cast<std::size_t>(v)]);
  RowFrame frame{};
  frame.units_per_m = depth.units_per_m;
  frame.range_m = range_m_;
  const Eigen::Matrix3d rotation = base_T_depth.rotation();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) frame.rotation[i][j] = rotation(i, j);
    frame.translation_m[i] = base_T_depth.translation()[i];
    frame.origin_m[i] = static_cast<float>(frame.translation_m[i]);
  }
  const RowArrays arrays{.width = depth.pixels.width,
                         .value = depth.pixels.data + first,
                         .x = ray_x_.data() + (per_pixel_ ? first : 0),
                         .y = per_pixel_ ? ray_y_.data() + first : row_y_.data(),
                         .z_m = row_z_m_.data(),
                         .distance_m = row_distance_m_.data(),
                         .end_m = {row_.end_x_m.data(), row_.end_y_m.data(), row_.end_z_m.data()},
                         .reach_m = row_.reach_m.data()};
  has_avx2() ? compute_ends_avx2(arrays, frame) : compute_ends_portable(arrays, frame);
  for (std::size_t c = 0; c < width; ++c) {
    // A distance that overflows has no direction left; nothing is cleared then.
    PixelKind kind = row_distance_m_[c] <= range_m_      ? PixelKind::kHit
                     : std::isfinite(row_distance_m_[c]) ? PixelKind::kBeyond
                                                         : PixelKind::kNoDirection;
    if (row_z_m_[c] < sensor_.range_min_m) kind = PixelKind::kTooNear;
    if (!self_depth_m.empty() && row_z_m_[c] >= static_cast<double>(self_depth_m[first + c])) kind = PixelKind::kSelf;
    if (arrays.value[c] == 0 || std::isnan(arrays.x[c])) kind = PixelKind::kEmpty;
    row_.kind[c] = kind;
  }
}

}  // namespace firstlook
