/// Conversions against ITU-R BT.601 computed in doubles, and against what libjpeg itself wrote.
#include "hal/v4l2/pixels.hpp"

#include <linux/videodev2.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "platform/core/random.hpp"
#include "tests/support/jpeg_writer.hpp"

using namespace firstlook;
using namespace firstlook::v4l2;

namespace {

using Rgb = std::array<std::uint8_t, 3>;

/// BT.601 as its equations stand.
Rgb exact(double y, double cb, double cr, bool full) {
  const double luma = full ? y : (y - 16) * 255 / 219, u = (cb - 128) * (full ? 1 : 255.0 / 224),
               v = (cr - 128) * (full ? 1 : 255.0 / 224);
  const auto byte = [](double value) { return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))); };
  const double red = luma + 1.402 * v, blue = luma + 1.772 * u;
  return {byte(red), byte((luma - 0.299 * red - 0.114 * blue) / 0.587), byte(blue)};
}

struct Color {
  explicit Color(int w, int h) : pixels(static_cast<std::size_t>(w * h)), view{pixels.data(), w, h} {}
  std::vector<Rgb> pixels;
  ImageView<Rgb> view;
};
struct Gray {
  explicit Gray(int w, int h) : pixels(static_cast<std::size_t>(w * h)), view{pixels.data(), w, h} {}
  std::vector<std::uint8_t> pixels;
  MutableGrayImage view;
};

}  // namespace

TEST_CASE("colours are BT.601 for every code, in both ranges", "[v4l2][pixels]") {
  for (const bool full : {false, true}) {
    std::size_t differ = 0, total = 0;
    for (int y = 0; y < 256; ++y) {
      // All pairs of chroma of one luma as one picture.
      const PictureLayout layout{PixelFormat::kYuyv, 512, 256, 1024, full};
      std::vector<std::uint8_t> bytes;
      bytes.reserve(layout.bytes());
      for (int cr = 0; cr < 256; ++cr) {
        for (int cb = 0; cb < 256; ++cb) {
          for (const int code : {y, cb, y, cr}) bytes.push_back(static_cast<std::uint8_t>(code));
        }
      }
      Color image(512, 256);
      REQUIRE(to_rgb(layout, bytes, image.view));
      int worst = 0;
      for (int cr = 0; cr < 256; ++cr) {
        for (int cb = 0; cb < 256; ++cb) {
          const Rgb expected = exact(y, cb, cr, full), found = image.view.at(2 * cb, cr);
          for (std::size_t c = 0; c < 3; ++c) {
            worst = std::max(worst, std::abs(expected[c] - found[c]));
            differ += expected[c] != found[c];
            ++total;
          }
        }
      }
      REQUIRE(worst <= 1);
    }
    CHECK(static_cast<double>(differ) < 1e-3 * static_cast<double>(total));  // ties of rounding
  }
}

TEST_CASE("grey is luma: stretched where the range is not full, and white is white", "[v4l2][pixels]") {
  std::vector<std::uint8_t> codes(256);
  for (std::size_t i = 0; i < 256; ++i) codes[i] = static_cast<std::uint8_t>(i);
  Gray image(256, 1);
  REQUIRE(to_gray({PixelFormat::kGrey, 256, 1, 256, true}, codes, image.view));
  CHECK(image.pixels == codes);
  REQUIRE(to_gray({PixelFormat::kGrey, 256, 1, 256, false}, codes, image.view));
  for (std::size_t i = 0; i < 256; ++i) {
    const double stretched = std::clamp((static_cast<double>(i) - 16) * 255 / 219, 0.0, 255.0);
    CHECK(image.pixels[i] == static_cast<std::uint8_t>(std::lround(stretched)));
  }
  CHECK(image.pixels[16] == 0);
  CHECK(image.pixels[235] == 255);
}

TEST_CASE("each format finds its samples, with rows longer than the picture", "[v4l2][pixels]") {
  Random random(5);
  constexpr int kWidth = 10, kHeight = 6;
  std::vector<int> y(kWidth * kHeight), cb(kWidth / 2 * kHeight), cr(cb.size());
  for (auto* plane : {&y, &cb, &cr}) {
    for (int& v : *plane) v = random.below(256);
  }
  const auto luma = [&](int c, int r) { return y[static_cast<std::size_t>(r * kWidth + c)]; };
  SECTION("YUYV") {
    const PictureLayout layout{PixelFormat::kYuyv, kWidth, kHeight, 32, true};
    std::vector<std::uint8_t> bytes(32 * kHeight, 0xEE);
    for (int r = 0; r < kHeight; ++r) {
      for (int c = 0; c < kWidth; ++c) {
        const auto pair = static_cast<std::size_t>(r * kWidth / 2 + c / 2);
        bytes[static_cast<std::size_t>(32 * r + 2 * c)] = static_cast<std::uint8_t>(luma(c, r));
        bytes[static_cast<std::size_t>(32 * r + 2 * c + 1)] =
            static_cast<std::uint8_t>(c % 2 == 0 ? cb[pair] : cr[pair]);
      }
    }
    Color color(kWidth, kHeight);
    Gray gray(kWidth, kHeight);
    REQUIRE(to_rgb(layout, bytes, color.view));
    REQUIRE(to_gray(layout, bytes, gray.view));
    for (int r = 0; r < kHeight; ++r) {
      for (int c = 0; c < kWidth; ++c) {
        const auto pair = static_cast<std::size_t>(r * kWidth / 2 + c / 2);
        CHECK(gray.view.at(c, r) == luma(c, r));
        const Rgb expected = exact(luma(c, r), cb[pair], cr[pair], true);
        for (std::size_t k = 0; k < 3; ++k) CHECK(std::abs(expected[k] - color.view.at(c, r)[k]) <= 1);
      }
    }
  }
  SECTION("NV12") {
    const PictureLayout layout{PixelFormat::kNv12, kWidth, kHeight, 16, true};
    std::vector<std::uint8_t> bytes(16 * (kHeight + kHeight / 2), 0xEE);
    for (int r = 0; r < kHeight; ++r) {
      for (int c = 0; c < kWidth; ++c)
        bytes[static_cast<std::size_t>(16 * r + c)] = static_cast<std::uint8_t>(luma(c, r));
    }
    for (int r = 0; r < kHeight / 2; ++r) {
      for (int c = 0; c < kWidth / 2; ++c) {
        const auto at = static_cast<std::size_t>(16 * (kHeight + r) + 2 * c),
                   pair = static_cast<std::size_t>(r * kWidth / 2 + c);
        bytes[at] = static_cast<std::uint8_t>(cb[pair]);
        bytes[at + 1] = static_cast<std::uint8_t>(cr[pair]);
      }
    }
    Color color(kWidth, kHeight);
    Gray gray(kWidth, kHeight);
    REQUIRE(to_rgb(layout, bytes, color.view));
    REQUIRE(to_gray(layout, bytes, gray.view));
    for (int r = 0; r < kHeight; ++r) {
      for (int c = 0; c < kWidth; ++c) {
        const auto pair = static_cast<std::size_t>(r / 2 * kWidth / 2 + c / 2);
        CHECK(gray.view.at(c, r) == luma(c, r));
        const Rgb expected = exact(luma(c, r), cb[pair], cr[pair], true);
        for (std::size_t k = 0; k < 3; ++k) CHECK(std::abs(expected[k] - color.view.at(c, r)[k]) <= 1);
      }
    }
  }
}

TEST_CASE("a JPEG is read with and without its Huffman tables, a broken one is refused", "[v4l2][pixels]") {
  constexpr int kWidth = 64, kHeight = 48;
  std::vector<Rgb> drawn(kWidth * kHeight);
  for (int r = 0; r < kHeight; ++r) {
    for (int c = 0; c < kWidth; ++c) {
      drawn[static_cast<std::size_t>(r * kWidth + c)] = {static_cast<std::uint8_t>(4 * c),
                                                         static_cast<std::uint8_t>(5 * r), 90};
    }
  }
  const std::vector<std::uint8_t> jpeg = test::write_jpeg({drawn.data(), kWidth, kHeight});
  const std::vector<std::uint8_t> bare = test::without_huffman_tables(jpeg);
  REQUIRE(bare.size() < jpeg.size());
  const PictureLayout layout{PixelFormat::kMjpeg, kWidth, kHeight, 0, true};
  Color whole(kWidth, kHeight), tableless(kWidth, kHeight);
  REQUIRE(to_rgb(layout, jpeg, whole.view));
  REQUIRE(to_rgb(layout, bare, tableless.view));
  CHECK(whole.pixels == tableless.pixels);
  int worst = 0;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) worst = std::max(worst, std::abs(drawn[i][k] - whole.pixels[i][k]));
  }
  CHECK(worst < 12);
  Gray gray(kWidth, kHeight);
  REQUIRE(to_gray(layout, jpeg, gray.view));
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    CHECK(std::abs(0.299 * whole.pixels[i][0] + 0.587 * whole.pixels[i][1] + 0.114 * whole.pixels[i][2] -
                   gray.pixels[i]) < 2);
  }
  for (std::size_t size = 0; size < jpeg.size(); size += 23) {  // cut anywhere
    const Status status = to_gray(layout, std::span(jpeg).first(size), gray.view);
    REQUIRE_FALSE(status);
    CHECK(status.error().fault == Fault::kFrameRefused);
  }
  Random random(3);
  for (int i = 0; i < 300; ++i) {  // and damaged anywhere: read or refused, never worse
    std::vector<std::uint8_t> damaged = jpeg;
    for (int n = 0; n < 3; ++n) {
      damaged[static_cast<std::size_t>(random.below(static_cast<int>(jpeg.size())))] =
          static_cast<std::uint8_t>(random.bits());
    }
    (void)to_gray(layout, damaged, gray.view);
  }
  Gray other(kWidth, kHeight / 2);
  CHECK_FALSE(to_gray({PixelFormat::kMjpeg, kWidth, kHeight / 2, 0, true}, jpeg, other.view));
}

TEST_CASE("too few bytes, another size and a grey camera's colours are refused", "[v4l2][pixels]") {
  const PictureLayout layout{PixelFormat::kYuyv, 16, 8, 40, false};
  const std::vector<std::uint8_t> bytes(layout.bytes());
  CHECK(layout.bytes() == 40 * 7 + 32);  // the last row has no padding
  Gray gray(16, 8), other(8, 8);
  CHECK(to_gray(layout, bytes, gray.view));
  CHECK_FALSE(to_gray(layout, std::span(bytes).first(bytes.size() - 1), gray.view));
  CHECK_FALSE(to_gray(layout, bytes, other.view));
  Color color(16, 8);
  CHECK_FALSE(to_rgb({PixelFormat::kGrey, 16, 8, 16, false}, bytes, color.view));
  CHECK(format_of(V4L2_PIX_FMT_YUYV) == PixelFormat::kYuyv);
  CHECK_FALSE(format_of(V4L2_PIX_FMT_H264).has_value());
  CHECK(std::string(fourcc_text(V4L2_PIX_FMT_NV12).data()) == "NV12");
}
