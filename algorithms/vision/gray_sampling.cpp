#include "algorithms/vision/gray_sampling.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

constexpr std::size_t kLanes = 64;  // points at a time, whose numbers stay in the first cache

/// Of up to kLanes points.
inline void sample(GrayImage image, const double* u, const double* v, double* gray, std::size_t count) {
  const int width = image.width, height = image.height;
  const double u_max = width - 1.0, v_max = height - 1.0;
  std::array<double, kLanes> right, down, top_left, top_right, low_left, low_right;
  std::array<int, kLanes> at;
  for (std::size_t k = 0; k < count; ++k) {
    const double x = std::min(std::max(u[k], 0.0), u_max), y = std::min(std::max(v[k], 0.0), v_max);
    const int u0 = std::min(static_cast<int>(x), width - 2), v0 = std::min(static_cast<int>(y), height - 2);
    right[k] = x - u0, down[k] = y - v0;
    at[k] = v0 * width + u0;
  }
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint8_t* const top = image.data + at[k];
    const std::uint8_t* const low = top + width;
    top_left[k] = top[0], top_right[k] = top[1], low_left[k] = low[0], low_right[k] = low[1];
  }
  for (std::size_t k = 0; k < count; ++k) {
    const double a = right[k], b = down[k];
    gray[k] = (1 - b) * ((1 - a) * top_left[k] + a * top_right[k]) + b * ((1 - a) * low_left[k] + a * low_right[k]);
  }
}
// The same instructions in the same order, several points at a time where the processor can: the same bits.
FIRSTLOOK_AVX2 void sample_avx2(GrayImage image, const double* u, const double* v, double* gray, std::size_t count) {
  sample(image, u, v, gray, count);
}
void sample_portable(GrayImage image, const double* u, const double* v, double* gray, std::size_t count) {
  sample(image, u, v, gray, count);
}

}  // namespace

double gray_between(GrayImage image, const Eigen::Vector2d& px) {
  const double u = std::clamp(px.x(), 0.0, image.width - 1.0), v = std::clamp(px.y(), 0.0, image.height - 1.0);
  const int u0 = std::min(static_cast<int>(u), image.width - 2), v0 = std::min(static_cast<int>(v), image.height - 2);
  const double a = u - u0, b = v - v0;
  const std::uint8_t* top = &image.at(u0, v0);
  const std::uint8_t* low = top + image.width;
  return (1 - b) * ((1 - a) * top[0] + a * top[1]) + b * ((1 - a) * low[0] + a * low[1]);
}

void grays_between(GrayImage image, std::span<const double> u, std::span<const double> v, std::span<double> gray) {
  const bool avx2 = has_avx2();
  for (std::size_t k = 0; k < gray.size(); k += kLanes) {
    (avx2 ? sample_avx2 : sample_portable)(image, &u[k], &v[k], &gray[k], std::min(kLanes, gray.size() - k));
  }
}

}  // namespace firstlook
