#include "hal/sim/pixel_noise.hpp"

#include <cmath>
#include <numbers>

namespace firstlook::sim {
namespace {

constexpr int kSteps = 4096;
using Quantiles = std::array<float, kSteps + 1>;

/// The point below which a standard normal number falls with probability p, by bisection.
double quantile(double p) {
  double low = -8, high = 8;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::numbers::sqrt2) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Quantiles make_quantiles() {
  Quantiles table{};
  for (int i = 1; i < kSteps; ++i) {
    table[static_cast<std::size_t>(i)] = static_cast<float>(quantile(static_cast<double>(i) / kSteps));
  }
  // The outermost steps end where their mean is that of the tail they stand for.
  table[0] = -3.7F, table[kSteps] = 3.7F;
  return table;
}

}  // namespace

float normal_of(std::uint64_t bits) {
  static const Quantiles kTable = make_quantiles();
  const auto step = static_cast<std::size_t>((bits >> 12) & 0xfffU);
  const float within = static_cast<float>(bits & 0xfffU) * (1.0F / 4096.0F);
  return kTable[step] + within * (kTable[step + 1] - kTable[step]);
}

}  // namespace firstlook::sim
