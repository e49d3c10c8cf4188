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
  float* squared_m2;  // of the ray's length
  float* end_m[3];
  float* reach_m;
  PixelKind* kind;
};
/// Cuts the rays that are longer than the range.
[[gnu::always_inline]] inline void cut_ends(const RowArrays& a, const RayFrame& f) {
  const auto cut = static_cast<float>(f.range_m);
  for (int axis = 0; axis < 3; ++axis) {
    const float origin = f.origin_m[axis];
    float* __restrict end = a.end_m[axis];
    for (int c = 0; c < a.width; ++c) {
      const auto distance = static_cast<float>(std::sqrt(static_cast<double>(a.squared_m2[c])));
      const float cut_end = origin + (end[c] - origin) / distance * cut;
      end[c] = a.squared_m2[c] <= f.range_squared_m2 ? end[c] : cut_end;
    }
  }
  for (int c = 0; c < a.width; ++c) {
    const double cut_z = a.z_m[c] * (f.range_m / std::sqrt(static_cast<double>(a.squared_m2[c])));
    a.reach_m[c] = a.squared_m2[c] <= f.range_squared_m2 ? a.reach_m[c] : static_cast<float>(cut_z);
  }
}

/// Ends of the rays, with or without a return; `end_m` is where the ray is cut when it is longer than the range. Kinds
/// but for the arm's own body and missing rays.
[[gnu::always_inline]] inline void compute_ends(const RowArrays& a, const RayFrame& f) {
  for (int c = 0; c < a.width; ++c) a.z_m[c] = static_cast<double>(a.value[c]) / f.units_per_m;
  float* __restrict end_x = a.end_m[0];
  float* __restrict end_y = a.end_m[1];
  float* __restrict end_z = a.end_m[2];
  const auto& r = f.rotation;
  for (int c = 0; c < a.width; ++c) {
    const double z = a.z_m[c], x = a.x[c] * z, y = a.y[c] * z;
    end_x[c] = static_cast<float>(r[0][0] * x + r[0][1] * y + r[0][2] * z + f.translation_m[0]);
    end_y[c] = static_cast<float>(r[1][0] * x + r[1][1] * y + r[1][2] * z + f.translation_m[1]);
    end_z[c] = static_cast<float>(r[2][0] * x + r[2][1] * y + r[2][2] * z + f.translation_m[2]);
    a.reach_m[c] = static_cast<float>(z);
  }
  const float ox = f.origin_m[0], oy = f.origin_m[1], oz = f.origin_m[2];
  std::int32_t longer = 0;
  for (int c = 0; c < a.width; ++c) {
    const float x = end_x[c] - ox, y = end_y[c] - oy, z = end_z[c] - oz;
    a.squared_m2[c] = x * x + y * y + z * z;
    longer |= static_cast<std::int32_t>(!(a.squared_m2[c] <= f.range_squared_m2));
  }
  for (int c = 0; c < a.width; ++c) {
    // A distance that overflows has no direction left; nothing is cleared then.
    std::int32_t kind = a.squared_m2[c] <= std::numeric_limits<float>::max()
                            ? static_cast<std::int32_t>(PixelKind::kBeyond)
                            : static_cast<std::int32_t>(PixelKind::kNoDirection);
    kind = a.squared_m2[c] <= f.range_squared_m2 ? static_cast<std::int32_t>(PixelKind::kHit) : kind;
    kind = a.value[c] < f.value_min ? static_cast<std::int32_t>(PixelKind::kTooNear) : kind;
    a.kind[c] = static_cast<PixelKind>(kind);
  }
  if (longer != 0) cut_ends(a, f);
}
// The same instructions in the same order, several pixels at a time where the processor can: the same bits.
FIRSTLOOK_AVX2 void compute_ends_avx2(const RowArrays& a, const RayFrame& f) { compute_ends(a, f); }
void compute_ends_portable(const RowArrays& a, const RayFrame& f) { compute_ends(a, f); }

/// The largest float whose root does not exceed the range: one comparison instead of a root for each pixel.
float range_squared(double range_m) {
  auto squared = static_cast<float>(range_m * range_m);
  while (std::sqrt(static_cast<double>(squared)) > range_m) squared = std::nextafter(squared, 0.0F);
  const auto more = [&] { return std::nextafter(squared, std::numeric_limits<float>::infinity()); };
  while (std::sqrt(static_cast<double>(more())) <= range_m) squared = more();
  return squared;
}

/// The first depth value that is not nearer than the minimum range.
std::int32_t first_value(double range_min_m, double units_per_m) {
  constexpr std::int32_t kValues = 65536;
  auto value = static_cast<std::int32_t>(std::clamp<double>(range_min_m * units_per_m, 0, kValues));
  while (value > 0 && (value - 1) / units_per_m >= range_min_m) --value;
  while (value < kValues && value / units_per_m < range_min_m) ++value;
  return value;
}

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
      range_squared_m2_(range_squared(range_m_)),
      per_pixel_(distorted(sensor.intrinsics)) {
  const CameraIntrinsics& c = sensor.intrinsics;
  ENSURE(3022, c.width > 0 && c.height > 0 && c.fx > 0 && c.fy > 0 && std::isfinite(c.cx) && std::isfinite(c.cy));
  const auto width = static_cast<std::size_t>(c.width);
  for (auto* doubles : {&row_y_, &row_z_m_}) doubles->resize(width);
  for (auto* floats : {&row_.end_x_m, &row_.end_y_m, &row_.end_z_m, &row_.reach_m, &row_squared_m2_})
    floats->resize(width);
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

PixelCounts counts_of(const std::array<std::uint32_t, kPixelKinds>& pixels) {
  const auto count = [&pixels](PixelKind kind) { return pixels[static_cast<std::size_t>(kind)]; };
  return {.pixels_used = count(PixelKind::kHit),
          .pixels_beyond = count(PixelKind::kBeyond) + count(PixelKind::kNoDirection),
          .pixels_empty = count(PixelKind::kEmpty),
          .pixels_too_near = count(PixelKind::kTooNear),
          .pixels_self = count(PixelKind::kSelf)};
}

std::size_t DepthRays::required_bytes(const DepthSensor& sensor) {
  const auto width = static_cast<std::size_t>(sensor.intrinsics.width);
  const auto height = static_cast<std::size_t>(sensor.intrinsics.height);
  const std::size_t row = width * (2 * sizeof(double) + 5 * sizeof(float) + 1);
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

RayFrame DepthRays::frame(double units_per_m, const Transform<Base, Depth>& base_T_depth) const {
  RayFrame frame{};
  frame.units_per_m = units_per_m;
  frame.range_m = range_m_;
  frame.range_squared_m2 = range_squared_m2_;
  frame.value_min = first_value(sensor_.range_min_m, units_per_m);
  const Eigen::Matrix3d rotation = base_T_depth.rotation();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) frame.rotation[i][j] = rotation(i, j);
    frame.translation_m[i] = base_T_depth.translation()[i];
    frame.origin_m[i] = static_cast<float>(frame.translation_m[i]);
  }
  return frame;
}

RayEnd DepthRays::ray(const RayFrame& frame, const DepthImage& depth, int u, int v) const {
  const auto row = static_cast<std::size_t>(v), column = static_cast<std::size_t>(u);
  const std::size_t pixel = row * static_cast<std::size_t>(depth.pixels.width) + column;
  double z_m = 0;
  float squared_m2 = 0;
  RayEnd ray;
  PixelKind kind{};
  const RowArrays one{.width = 1,
                      .value = depth.pixels.data + pixel,
                      .x = ray_x_.data() + (per_pixel_ ? pixel : column),
                      .y = ray_y_.data() + (per_pixel_ ? pixel : row),
                      .z_m = &z_m,
                      .squared_m2 = &squared_m2,
                      .end_m = {&ray.end_m.x(), &ray.end_m.y(), &ray.end_m.z()},
                      .reach_m = &ray.reach_m,
                      .kind = &kind};
  compute_ends(one, frame);
  ray.is_hit = kind == PixelKind::kHit;
  return ray;
}

void DepthRays::compute_row(const RayFrame& frame, const DepthImage& depth, std::span<const float> self_depth_m,
                            int v) {
  const auto width = static_cast<std::size_t>(depth.pixels.width);
  const std::size_t first = static_cast<std::size_t>(v) * width;
  if (!per_pixel_) std::fill(row_y_.begin(), row_y_.end(), ray_y_[static_cast<std::size_t>(v)]);
  const RowArrays arrays{.width = depth.pixels.width,
                         .value = depth.pixels.data + first,
                         .x = ray_x_.data() + (per_pixel_ ? first : 0),
                         .y = per_pixel_ ? ray_y_.data() + first : row_y_.data(),
                         .z_m = row_z_m_.data(),
                         .squared_m2 = row_squared_m2_.data(),
                         .end_m = {row_.end_x_m.data(), row_.end_y_m.data(), row_.end_z_m.data()},
                         .reach_m = row_.reach_m.data(),
                         .kind = row_.kind.data()};
  has_avx2() ? compute_ends_avx2(arrays, frame) : compute_ends_portable(arrays, frame);
  if (!self_depth_m.empty()) {
    for (std::size_t c = 0; c < width; ++c) {
      const bool self = row_z_m_[c] >= static_cast<double>(self_depth_m[first + c]);
      row_.kind[c] = self ? PixelKind::kSelf : row_.kind[c];
    }
  }
  for (std::size_t c = 0; c < width; ++c) row_.kind[c] = arrays.value[c] == 0 ? PixelKind::kEmpty : row_.kind[c];
  if (per_pixel_) {
    for (std::size_t c = 0; c < width; ++c) row_.kind[c] = std::isnan(arrays.x[c]) ? PixelKind::kEmpty : row_.kind[c];
  }
}

}  // namespace firstlook
