/// Grey values and colours from the bytes of a camera's formats. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook::v4l2 {

enum class PixelFormat : std::uint8_t {
  kGrey,   ///< one byte of luma
  kYuyv,   ///< 4:2:2 packed: Y0 Cb Y1 Cr
  kNv12,   ///< 4:2:0: a plane of luma, then one of Cb Cr for each 2 x 2
  kMjpeg,  ///< a JPEG picture, often without its Huffman tables
};

/// The format of a V4L2 four character code; empty for those that we do not read.
[[nodiscard]] std::optional<PixelFormat> format_of(std::uint32_t fourcc);
[[nodiscard]] std::uint32_t fourcc_of(PixelFormat format);
/// "YUYV".
[[nodiscard]] std::array<char, 5> fourcc_text(std::uint32_t fourcc);

/// What the bytes of a picture mean.
struct PictureLayout {
  PixelFormat format = PixelFormat::kYuyv;
  int width = 0, height = 0;
  std::size_t stride = 0;   ///< bytes from row to row of the first plane; not used for JPEG
  bool full_range = false;  ///< luma from 0 to 255 instead of 16 to 235 (ITU-R BT.601); JPEG is always full
  /// Bytes that a whole picture has at least; 0 for JPEG.
  [[nodiscard]] std::size_t bytes() const;
  /// The same without padding behind the rows.
  [[nodiscard]] PictureLayout tight() const;
};

/// Copies a whole picture without the padding behind its rows: `to` has `layout.tight().bytes()`. A JPEG as it is.
void copy_tight(const PictureLayout& layout, std::span<const std::uint8_t> bytes, std::span<std::uint8_t> to);

/// Luma, stretched from 16..235 to 0..255 where the range is not full.
/// Error: kFrameRefused when bytes are missing, the size of `image` is another, or the JPEG is broken.
[[nodiscard]] Status to_gray(const PictureLayout& layout, std::span<const std::uint8_t> bytes, MutableGrayImage image);

/// Red, green, blue by ITU-R BT.601. Errors as to_gray(); kFrameRefused for a grey format, too.
[[nodiscard]] Status to_rgb(const PictureLayout& layout, std::span<const std::uint8_t> bytes,
                            ImageView<std::array<std::uint8_t, 3>> image);

}  // namespace firstlook::v4l2
