#include "algorithms/mapping/open_rays.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/mapping/octants.hpp"
#include "algorithms/mapping/ray_marker.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr double kFadingShare = 0.9;  // of the sensor's range: from here on a surface is about to be lost

// Directions of look_around(); each takes two bits: a fading return, a nearer surface.
constexpr int kLeft = 0, kRight = 2, kAbove = 4, kBelow = 6;
constexpr std::uint8_t kAnyFading = 0b01010101, kAnySurface = 0b10101010;
constexpr std::uint8_t kFlankedAcross = 0b00001010, kFlankedUpright = 0b10100000;

bool all_of(std::uint8_t around, std::uint8_t bits) { return (around & bits) == bits; }

}  // namespace

OpenRays::OpenRays(const GridGeometry& geometry, const DepthSensor& sensor)
    : geometry_(geometry),
      rays_(sensor),
      sensor_(sensor),
      range_m_(rays_.range_m()),
      stride_(std::max(1, static_cast<int>(sensor.intrinsics.fx * geometry.resolution_m / 2 / range_m_))),
      reach_(sensor.intrinsics.width, sensor.intrinsics.height) {
  const CameraIntrinsics& c = sensor.intrinsics;
  const std::size_t pixels = static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height);
  shows_.resize(pixels);
  around_.resize(pixels);
  open_.resize(pixels);
  row_reach_m_.resize(static_cast<std::size_t>(c.width));
  passed_.resize(VoxelMap::bit_words(geometry));
  suspect_.resize(passed_.size());
}

std::size_t OpenRays::required_bytes(const GridGeometry& geometry, const DepthSensor& sensor) {
  const CameraIntrinsics& c = sensor.intrinsics;
  const std::size_t pixels = static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height);
  return DepthRays::required_bytes(sensor) + 3 * pixels + static_cast<std::size_t>(c.width) * sizeof(float) +
         RangeImage::required_bytes(c.width, c.height) + 2 * VoxelMap::bit_words(geometry) * sizeof(std::uint64_t);
}

void OpenRays::look(const DepthImage& depth, std::span<const float> self_depth_m) {
  ENSURE(3121, depth.pixels.size() == shows_.size());
  look_at_pixels(depth, self_depth_m);
  look_around();
  look_for_shade(depth, self_depth_m);
}

OpenRaysResult OpenRays::clear(VoxelMap& map, const Transform<Base, Depth>& base_T_depth, const FrameMarks& marks,
                               double stamp_s, double free_max_age_s) {
  ENSURE(3122, map.geometry() == geometry_);
  std::ranges::fill(passed_, 0);
  std::ranges::fill(suspect_, 0);
  const Frame frame{map, base_T_depth, stamp_s, free_max_age_s};
  RayMarker open_rays(geometry_, base_T_depth.translation().cast<float>(), passed_);
  RayMarker flanked_rays(geometry_, base_T_depth.translation().cast<float>(), suspect_);
  const CameraIntrinsics& c = sensor_.intrinsics;
  OpenRaysResult result;
  for (int v = 0; v < c.height; v += stride_) {
    for (int u = 0; u < c.width; u += stride_) {
      open_block(frame, u, v);
      const int middle_u = std::min(u + stride_ / 2, c.width - 1), middle_v = std::min(v + stride_ / 2, c.height - 1);
      const bool is_open = open_[at(middle_u, middle_v)] != 0, flanked = is_flanked(middle_u, middle_v);
      if (!is_open && !flanked) continue;
      const Eigen::Vector3f end_m =
          (base_T_depth * Eigen::Vector3d(rays_.direction(middle_u, middle_v).normalized() * range_m_)).cast<float>();
      (is_open ? open_rays : flanked_rays).mark_passed(end_m);
      result.pixels_flanked += flanked ? 1 : 0;
    }
  }
  for (int v = 0; v < c.height; ++v) {
    for (int u = 0; u < c.width; ++u) {
      const bool is_open = open_[at(u, v)] != 0;
      result.pixels_open += is_open ? 1 : 0;
      row_reach_m_[static_cast<std::size_t>(u)] =
          is_open ? static_cast<float>(range_m_ / rays_.direction(u, v).norm()) : RangeImage::kNoRay;
    }
    reach_.set_row(v, row_reach_m_);
  }
  for (std::size_t word = 0; word < passed_.size(); ++word) passed_[word] &= ~(marks.missed[word] | marks.hit[word]);
  map.suspect(suspect_);
  result.voxels_cleared = map.apply_open(passed_, base_T_depth, stamp_s).voxels_missed;
  note_crossed_octants(map, passed_, marks.hit, reach_, sensor_, rays_.is_pinhole(), base_T_depth);
  return result;
}

void OpenRays::look_at_pixels(const DepthImage& depth, std::span<const float> self_depth_m) {
  const double fading = kFadingShare * sensor_.range_max_m * depth.units_per_m;
  const auto width = static_cast<std::size_t>(depth.pixels.width);
  const auto has_ray = [&](std::size_t i) {
    return !std::isnan(rays_.direction(static_cast<int>(i % width), static_cast<int>(i / width)).x());
  };
  const auto is_far = [&](std::size_t i) { return static_cast<double>(depth.pixels.data[i]) >= fading; };
  for (std::size_t i = 0; i < shows_.size(); ++i) {
    const bool on_arm = !self_depth_m.empty() && std::isfinite(self_depth_m[i]);
    if (on_arm || !has_ray(i)) {
      shows_[i] = Shows::kSurface;
    } else if (depth.pixels.data[i] == 0) {
      shows_[i] = Shows::kNothing;
    } else if (!is_far(i)) {
      shows_[i] = Shows::kSurface;
    } else {
      // One far pixel alone may be an error; it tells nothing.
      const bool left = i % width > 0 && is_far(i - 1), right = i % width + 1 < width && is_far(i + 1);
      shows_[i] = left || right ? Shows::kFading : Shows::kNothing;
    }
  }
}

void OpenRays::look_around() {
  const int width = sensor_.intrinsics.width, height = sensor_.intrinsics.height;
  std::ranges::fill(around_, 0);
  const auto look = [&](int count, int direction, auto index_of) {
    std::uint8_t nearest = 0;
    for (int k = 0; k < count; ++k) {
      const std::size_t i = index_of(k);
      if (shows_[i] != Shows::kNothing) nearest = shows_[i] == Shows::kFading ? 1 : 2;
      around_[i] = static_cast<std::uint8_t>(around_[i] | nearest << direction);
    }
  };
  for (int v = 0; v < height; ++v) {
    look(width, kLeft, [&](int k) { return at(k, v); });
    look(width, kRight, [&](int k) { return at(width - 1 - k, v); });
  }
  for (int u = 0; u < width; ++u) {
    look(height, kAbove, [&](int k) { return at(u, k); });
    look(height, kBelow, [&](int k) { return at(u, height - 1 - k); });
  }
}

/// A surface at column u_f and depth z_f stands between the projector at +baseline and what lies on the ray of column u
/// at depth z when u_f - u = fx b (1 / z_f - 1 / z). Beside the image there may be one at the minimum range.
void OpenRays::look_for_shade(const DepthImage& depth, std::span<const float> self_depth_m) {
  const CameraIntrinsics& c = sensor_.intrinsics;
  const double focal_baseline = c.fx * sensor_.baseline_m;
  const auto shade_px = [&](double z_m) {
    return sensor_.baseline_m == 0 ? -1.0 : focal_baseline * (1 / z_m - 1 / range_m_);
  };
  for (int v = 0; v < c.height; ++v) {
    double shaded_from = c.width - shade_px(sensor_.range_min_m);
    for (int u = c.width - 1; u >= 0; --u) {
      const std::size_t i = at(u, v);
      const std::uint8_t around = around_[i];
      open_[i] = shows_[i] == Shows::kNothing && depth.pixels.data[i] == 0 && (around & kAnyFading) != 0 &&
                         (around & kAnySurface) == 0 && u < shaded_from
                     ? 1
                     : 0;
      if (shows_[i] != Shows::kSurface) continue;
      double z_m = sensor_.range_min_m;
      if (depth.pixels.data[i] != 0) z_m = static_cast<double>(depth.pixels.data[i]) / depth.units_per_m;
      if (!self_depth_m.empty()) z_m = std::min(z_m, static_cast<double>(self_depth_m[i]));
      shaded_from = std::min(shaded_from, u - shade_px(z_m));
    }
  }
}

/// The ray up to the minimum range, and the light that falls on the rest of it: beside the ray by up to the baseline.
bool OpenRays::is_near_part_free(const Frame& frame, int u, int v) const {
  const double step_m = geometry_.resolution_m / 2;
  const Eigen::Vector3d along = rays_.direction(u, v);
  const int steps = static_cast<int>(std::ceil(sensor_.range_min_m / step_m));
  for (int k = 0; k <= steps; ++k) {
    const double z_m = sensor_.range_min_m * k / steps;
    const double beside_m = sensor_.baseline_m * (1 - z_m / range_m_);
    const int across = static_cast<int>(std::ceil(beside_m / step_m));
    for (int j = 0; j <= across; ++j) {
      const Eigen::Vector3d point_m = along * z_m + Eigen::Vector3d(across > 0 ? beside_m * j / across : 0, 0, 0);
      const Eigen::Vector3i voxel = geometry_.voxel(frame.base_T_depth * point_m);
      if (!geometry_.contains(voxel)) return false;
      const std::size_t index = geometry_.index(voxel);
      if (!frame.map.in_intact_safe_zone(index) && !frame.map.known_free(index, frame.now_s, frame.free_max_age_s))
        return false;
    }
  }
  return true;
}

/// A hole of three by three pixels with surfaces on both sides.
bool OpenRays::is_flanked(int u, int v) const {
  const std::uint8_t around = around_[at(u, v)];
  if (!all_of(around, kFlankedAcross) && !all_of(around, kFlankedUpright)) return false;
  const CameraIntrinsics& c = sensor_.intrinsics;
  if (u < 1 || v < 1 || u + 1 >= c.width || v + 1 >= c.height) return false;
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      if (shows_[at(u + du, v + dv)] != Shows::kNothing) return false;
    }
  }
  return true;
}

/// Pixels of a block are too close to each other to have near parts of their own.
void OpenRays::open_block(const Frame& frame, int u, int v) {
  const int u_end = std::min(u + stride_, sensor_.intrinsics.width);
  const int v_end = std::min(v + stride_, sensor_.intrinsics.height);
  bool any = false;
  for (int y = v; y < v_end; ++y) {
    for (int x = u; x < u_end; ++x) any = any || open_[at(x, y)] != 0;
  }
  if (!any || is_near_part_free(frame, (u + u_end - 1) / 2, (v + v_end - 1) / 2)) return;
  for (int y = v; y < v_end; ++y) std::fill_n(open_.begin() + static_cast<std::ptrdiff_t>(at(u, y)), u_end - u, 0);
}

}  // namespace firstlook
