/// Pixels from PNG and JPEG files, grey or in colours.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

struct GrayPixels {
  std::vector<std::uint8_t> pixels;
  int width = 0;
  int height = 0;
  [[nodiscard]] GrayImage view() const { return {pixels.data(), width, height}; }
};

struct ColorPixels {
  std::vector<std::array<std::uint8_t, 3>> pixels;  ///< red, green, blue
  int width = 0;
  int height = 0;
  [[nodiscard]] ImageView<const std::array<std::uint8_t, 3>> view() const { return {pixels.data(), width, height}; }
};

/// Reads an 8-bit grey picture from a PNG (any kind; 16 bits cut to 8, colour by ITU-R BT.601 weights, transparency
/// dropped) or JPEG file, told apart by their first bytes.
/// @return kDataMissing, or kDataMalformed for anything that is not a whole picture of at most 8192 x 8192 pixels
[[nodiscard]] Result<GrayPixels> read_gray_image(const std::filesystem::path& file);

/// The same in colours; a grey picture has three equal ones.
[[nodiscard]] Result<ColorPixels> read_color_image(const std::filesystem::path& file);

}  // namespace firstlook
