#include "algorithms/mapping/plane_fit.hpp"

#include <algorithm>
#include <cmath>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

std::size_t sum_count(const CameraIntrinsics& camera, const PlaneFitOptions& options) {
  return options.is_on() ? static_cast<std::size_t>(camera.width + 1) * static_cast<std::size_t>(camera.height + 1) : 0;
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

void PlaneFit::add_up(ImageView<const std::uint16_t> pixels, double units_per_m) {
  const auto row = static_cast<std::size_t>(width_) + 1;
  for (int v = 0; v < pixels.height; ++v) {
    Sums so_far;
    for (int u = 0; u < pixels.width; ++u) {
      if (const std::uint16_t value = pixels.at(u, v); value != 0) {
        const double d = units_per_m / value;
        so_far += {1, d, d * d, u * d, v * d};
      }
      const std::size_t here = static_cast<std::size_t>(v + 1) * row + static_cast<std::size_t>(u + 1);
      sums_[here] = sums_[here - row];
      sums_[here] += so_far;
    }
  }
}

PlaneFit::Sums PlaneFit::window(int u, int v) const {
  const int half = options_.window_px / 2;
  const auto at = [&](int column, int row) -> const Sums& {
    return sums_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_ + 1) +
                 static_cast<std::size_t>(column)];
  };
  Sums sums = at(u + half + 1, v + half + 1);
  sums -= at(u - half, v + half + 1);
  sums -= at(u + half + 1, v - half);
  sums += at(u - half, v - half);
  return sums;
}

std::uint32_t PlaneFit::apply(ImageView<std::uint16_t> pixels, double units_per_m) {
  if (!options_.is_on()) return 0;
  ENSURE(3126, pixels.width == width_ &&
                   (static_cast<std::size_t>(pixels.width) + 1) * (static_cast<std::size_t>(pixels.height) + 1) ==
                       sums_.size());
  add_up({pixels.data, pixels.width, pixels.height}, units_per_m);
  const int half = options_.window_px / 2;
  const double n = options_.window_px * options_.window_px;
  // Sum of squared column (or row) numbers around the middle, over the window.
  const double spread = n * (options_.window_px * options_.window_px - 1) / 12;
  // Squared residuals over the variance: their mean and three standard deviations of it.
  const double residual_max = (n - 3) + 3 * std::sqrt(2 * (n - 3));
  std::uint32_t replaced = 0;
  for (int v = half; v + half < pixels.height; ++v) {
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
