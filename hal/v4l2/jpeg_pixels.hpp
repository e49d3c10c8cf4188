/// The adapter to libjpeg: pictures of cameras that compress.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook::v4l2 {

/// Error: kFrameRefused for a picture that is broken, cut short, or of another size.
[[nodiscard]] Status jpeg_to_gray(std::span<const std::uint8_t> jpeg, MutableGrayImage image);
[[nodiscard]] Status jpeg_to_rgb(std::span<const std::uint8_t> jpeg, ImageView<std::array<std::uint8_t, 3>> image);

}  // namespace firstlook::v4l2
