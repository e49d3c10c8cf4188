/// One colour scale for heights in point clouds and pictures.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace firstlook {

/// Blue at the bottom over green and yellow to red at the top (hue 240 to 0 degrees, muted).
/// @param fraction  0 at the lowest, 1 at the highest voxel of the grid; cut to it
[[nodiscard]] inline std::array<std::uint8_t, 3> height_color(double fraction) {
  const double hue = 4 * (1 - std::clamp(fraction, 0.0, 1.0));  // sextants of the colour circle
  const auto channel = [hue](double center) {
    double away = std::min(std::abs(hue - center), 6 - std::abs(hue - center));
    const double strength = std::clamp(2 - away, 0.0, 1.0);
    return static_cast<std::uint8_t>(50 + 180 * strength);
  };
  return {channel(0), channel(2), channel(4)};
}

}  // namespace firstlook
