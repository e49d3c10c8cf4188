#include "algorithms/mapping/plane_fit.hpp"

#include <algorithm>
#include <cmath>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

/// The rows of sums that a window needs, those between its first and last among them.
std::size_t sum_rows(const PlaneFitOptions& options) { return static_cast<std::size_t>(options.window_px) + 1; }

std::size_t sum_count(const CameraIntrinsics& camera, const PlaneFitOptions& options) {
  return options.is_on() ? static_cast<std::size_t>(camera.width + 1) * sum_rows(options) : 0;
}

}  // namespace

PlaneFit::Sums& PlaneFit::Sums::operator+=(const Sums& other) {
  n += other.n, d += other.d, dd += other.dd, ud += other.ud, vd += other.vd;
  return *this;
}

PlaneFit::Sums& PlaneFit::Sums::operator-=(const Sums& other) {
  n -= other.n, d -= other.d, dd -= other.dd, ud -= other.ud, vd -= other.vd;
  return *this;
}

PlaneFit::PlaneFit(const CameraIntrinsics& camera, const PlaneFitOptions& options)
    : options_(options), width_(camera.width), sums_(sum_count(camera, options)) {
  ENSURE(3124, !options.is_on() || (options.window_px >= 3 && options.window_px <= 31 && options.window_px % 2 == 1));
  ENSURE(3125, !options.is_on() || std::hypot(options.noise_floor_m, options.noise_at_1m_m) > 0);
}

std::size_t PlaneFit::required_bytes(const CameraIntrinsics& camera, const PlaneFitOptions& options) {
  return sum_count(camera, options) * sizeof(Sums);
}

std::span<PlaneFit::Sums> PlaneFit::sums_above(int row) {
  const auto length = static_cast<std::size_t>(width_) + 1;
  return std::span(sums_).subspan(static_cast<std::size_t>(row) % sum_rows(options_) * length, length);
}

void PlaneFit::add_row(ImageView<const std::uint16_t> pixels, double units_per_m, int v) {
  const std::span<const Sums> above = sums_above(v);
  const std::span<Sums> below = sums_above(v + 1);
  Sums so_far;
  below[0] = {};
  for (int u = 0; u < pixels.width; ++u) {
    if (const std::uint16_t value = pixels.at(u, v); value != 0) {
      const double d = units_per_m / value;
      so_far += {1, d, d * d, u * d, v * d};
    }
    const auto next = static_cast<std::size_t>(u) + 1;
    below[next] = above[next];
    below[next] += so_far;
  }
}

PlaneFit::Sums PlaneFit::window(int u, int v) {
  const int half = options_.window_px / 2;
  const std::span<const Sums> top = sums_above(v - half), bottom = sums_above(v + half + 1);
  const auto left = static_cast<std::size_t>(u - half), right = static_cast<std::size_t>(u + half + 1);
  Sums sums = bottom[right];
  sums -= bottom[left];
  sums -= top[right];
  sums += top[left];
  return sums;
}

std::uint32_t PlaneFit::apply(ImageView<std::uint16_t> pixels, double units_per_m) {
  if (!options_.is_on()) return 0;
  ENSURE(3126, pixels.width == width_);
  std::ranges::fill(sums_above(0), Sums{});
  const int half = options_.window_px / 2;
  const double n = options_.window_px * options_.window_px;
  // Sum of squared column (or row) numbers around the middle, over the window.
  const double spread = n * (options_.window_px * options_.window_px - 1) / 12;
  // Squared residuals over the variance: their mean and three standard deviations of it.
  const double residual_max = (n - 3) + 3 * std::sqrt(2 * (n - 3));
  std::uint32_t replaced = 0;
  for (int row = 0; row < pixels.height; ++row) {
    // A row is added up as it was read; those that are moved lie above.
    add_row({pixels.data, pixels.width, pixels.height}, units_per_m, row);
    const int v = row - half;
    if (v < half) continue;
    for (int u = half; u + half < pixels.width; ++u) {
      const Sums s = window(u, v);
      if (s.n < n) continue;
      const double mean = s.d / n, z_m = 1 / mean;
      const double along_u = s.ud - u * s.d, along_v = s.vd - v * s.d;
      const double residual = s.dd - s.d * mean - (along_u * along_u + along_v * along_v) / spread;
      const double sigma_m = std::hypot(options_.noise_floor_m, options_.noise_at_1m_m * z_m * z_m);
      const double sigma = sigma_m * mean * mean;  // of an inverse depth
      if (residual > residual_max * sigma * sigma) continue;
      pixels.at(u, v) = static_cast<std::uint16_t>(std::clamp(std::lround(z_m * units_per_m), 1L, 65535L));
      ++replaced;
    }
  }
  return replaced;
}

}  // namespace firstlook
