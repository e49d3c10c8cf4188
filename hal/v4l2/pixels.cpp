#include "hal/v4l2/pixels.hpp"

#include <linux/videodev2.h>

#include <algorithm>

#include "hal/v4l2/jpeg_pixels.hpp"

namespace firstlook::v4l2 {
namespace {

// ITU-R BT.601, 16 bits behind the point, rounded to the nearest.
constexpr int kBits = 16;
constexpr int kHalf = 1 << (kBits - 1);
/// Of positive factors: twice as much, cut, and halved upwards.
constexpr int fixed(double v) { return (static_cast<int>(v * (2 << kBits)) + 1) / 2; }

/// Factors for one range of the codes: luma 219 and chroma 224 steps, or 255 each.
struct Factors {
  int black, luma, red_cr, green_cb, green_cr, blue_cb;
};
constexpr Factors factors(int black, double luma_steps, double chroma_steps) {
  const double y = 255 / luma_steps, c = 255 / chroma_steps;
  return {
      black,           fixed(y), fixed(1.402 * c), fixed(1.772 * 0.114 / 0.587 * c), fixed(1.402 * 0.299 / 0.587 * c),
      fixed(1.772 * c)};
}
constexpr Factors kLimited = factors(16, 219, 224);
constexpr Factors kFull = factors(0, 255, 255);

std::uint8_t clamp(int value) { return static_cast<std::uint8_t>(std::clamp(value >> kBits, 0, 255)); }

constexpr std::array<std::uint8_t, 256> stretched() {
  std::array<std::uint8_t, 256> table{};
  for (int code = 0; code < 256; ++code) {
    const int value = (kLimited.luma * (code - kLimited.black) + kHalf) >> kBits;
    table[static_cast<std::size_t>(code)] = static_cast<std::uint8_t>(std::clamp(value, 0, 255));
  }
  return table;
}
constexpr auto kStretched = stretched();

std::array<std::uint8_t, 3> rgb(const Factors& f, int y, int cb, int cr) {
  const int luma = f.luma * (y - f.black) + kHalf;
  return {clamp(luma + f.red_cr * (cr - 128)), clamp(luma - f.green_cb * (cb - 128) - f.green_cr * (cr - 128)),
          clamp(luma + f.blue_cb * (cb - 128))};
}

template <typename Image>
Status check(const PictureLayout& layout, std::span<const std::uint8_t> bytes, const Image& image) {
  if (image.data == nullptr || image.width != layout.width || image.height != layout.height) {
    return failure(Fault::kFrameRefused, "the image is {} x {}, the camera's {} x {}", image.width, image.height,
                   layout.width, layout.height);
  }
  if (bytes.size() < layout.bytes()) {
    return failure(Fault::kFrameRefused, "a picture of {} bytes, {} are needed", bytes.size(), layout.bytes());
  }
  return {};
}

std::size_t at(int n) { return static_cast<std::size_t>(n); }

}  // namespace

std::optional<PixelFormat> format_of(std::uint32_t fourcc) {
  switch (fourcc) {
    case V4L2_PIX_FMT_GREY:
      return PixelFormat::kGrey;
    case V4L2_PIX_FMT_YUYV:
      return PixelFormat::kYuyv;
    case V4L2_PIX_FMT_NV12:
      return PixelFormat::kNv12;
    case V4L2_PIX_FMT_MJPEG:
    case V4L2_PIX_FMT_JPEG:
      return PixelFormat::kMjpeg;
    default:
      return {};
  }
}

std::uint32_t fourcc_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::kGrey:
      return V4L2_PIX_FMT_GREY;
    case PixelFormat::kYuyv:
      return V4L2_PIX_FMT_YUYV;
    case PixelFormat::kNv12:
      return V4L2_PIX_FMT_NV12;
    case PixelFormat::kMjpeg:
      return V4L2_PIX_FMT_MJPEG;
  }
  return 0;
}

std::array<char, 5> fourcc_text(std::uint32_t fourcc) {
  std::array<char, 5> text{};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto c = static_cast<char>(fourcc >> (8 * i) & 0x7F);
    text[i] = c >= ' ' && c < 0x7F ? c : '?';
  }
  return text;
}

std::size_t PictureLayout::bytes() const {
  switch (format) {
    case PixelFormat::kGrey:
      return stride * at(height - 1) + at(width);
    case PixelFormat::kYuyv:
      return stride * at(height - 1) + 2 * at(width);
    case PixelFormat::kNv12:
      return stride * (at(height) + at(height / 2) - 1) + at(width);
    case PixelFormat::kMjpeg:
      return 0;
  }
  return 0;
}

PictureLayout PictureLayout::tight() const {
  PictureLayout packed = *this;
  packed.stride = at(width) * (format == PixelFormat::kYuyv ? 2 : 1);
  return packed;
}

void copy_tight(const PictureLayout& layout, std::span<const std::uint8_t> bytes, std::span<std::uint8_t> to) {
  const std::size_t row = layout.tight().stride;
  if (layout.format == PixelFormat::kMjpeg || layout.stride == row) {
    std::ranges::copy(bytes.first(to.size()), to.begin());
    return;
  }
  for (std::size_t from = 0, at_row = 0; at_row + row <= to.size(); from += layout.stride, at_row += row) {
    std::ranges::copy(bytes.subspan(from, row), to.subspan(at_row).begin());
  }
}

Status to_gray(const PictureLayout& layout, std::span<const std::uint8_t> bytes, MutableGrayImage image) {
  if (Status status = check(layout, bytes, image); !status) return status;
  if (layout.format == PixelFormat::kMjpeg) return jpeg_to_gray(bytes, image);
  const std::size_t step = layout.format == PixelFormat::kYuyv ? 2 : 1;
  for (int row = 0; row < layout.height; ++row) {
    const std::uint8_t* from = bytes.data() + layout.stride * at(row);
    std::uint8_t* const to = &image.at(0, row);
    for (std::size_t column = 0; column < at(layout.width); ++column, from += step) {
      to[column] = layout.full_range ? *from : kStretched[*from];
    }
  }
  return {};
}

Status to_rgb(const PictureLayout& layout, std::span<const std::uint8_t> bytes,
              ImageView<std::array<std::uint8_t, 3>> image) {
  if (Status status = check(layout, bytes, image); !status) return status;
  const Factors& f = layout.full_range ? kFull : kLimited;
  switch (layout.format) {
    case PixelFormat::kGrey:
      return failure(Fault::kFrameRefused, "the camera delivers grey values only");
    case PixelFormat::kMjpeg:
      return jpeg_to_rgb(bytes, image);
    case PixelFormat::kYuyv:
      for (int row = 0; row < layout.height; ++row) {
        const std::uint8_t* const line = bytes.data() + layout.stride * at(row);
        for (int column = 0; column < layout.width; ++column) {
          const std::uint8_t* const pair = line + 4 * at(column / 2);
          image.at(column, row) = rgb(f, line[2 * at(column)], pair[1], pair[3]);
        }
      }
      return {};
    case PixelFormat::kNv12:
      for (int row = 0; row < layout.height; ++row) {
        const std::uint8_t* const line = bytes.data() + layout.stride * at(row);
        const std::uint8_t* const chroma = bytes.data() + layout.stride * at(layout.height + row / 2);
        for (int column = 0; column < layout.width; ++column) {
          const std::uint8_t* const pair = chroma + 2 * at(column / 2);
          image.at(column, row) = rgb(f, line[column], pair[0], pair[1]);
        }
      }
      return {};
  }
  return {};
}

}  // namespace firstlook::v4l2
