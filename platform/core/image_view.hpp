/// A rectangle of pixels that somebody else owns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace firstlook {

/// Row-major pixels without padding; (column, row) with the origin at the top left pixel.
template <typename Pixel>
struct ImageView {
  Pixel* data = nullptr;
  int width = 0;
  int height = 0;

  [[nodiscard]] Pixel& at(int column, int row) const {
    return data[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column)];
  }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  [[nodiscard]] std::span<Pixel> pixels() const { return {data, size()}; }
};

using GrayImage = ImageView<const std::uint8_t>;
using MutableGrayImage = ImageView<std::uint8_t>;

/// Depth along the optical axis in sensor units; 0 means no return. depth_m = value / units_per_m.
struct DepthImage {
  ImageView<const std::uint16_t> pixels;
  double units_per_m = 1000;
};

}  // namespace firstlook
