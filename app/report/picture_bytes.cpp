#include "app/report/picture_bytes.hpp"

#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>

// jpeglib.h needs <cstdio> before it.
#include <jpeglib.h>

namespace firstlook {
namespace {

void append_bytes(png_structp png, png_bytep data, std::size_t size) {
  auto& out = *static_cast<std::vector<std::byte>*>(png_get_io_ptr(png));
  const auto* bytes = reinterpret_cast<const std::byte*>(data);
  out.insert(out.end(), bytes, bytes + size);
}

/// libpng reports errors by longjmp: nothing with a destructor may live in this function.
bool write_png(png_structp png, png_infop info, const std::uint8_t* pixels, int width, int height, int channels,
               std::vector<std::byte>* out) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_write_fn(png, out, append_bytes, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
               channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  // Fixed, so that the bytes do not depend on the library's own choice.
  png_set_compression_level(png, 6);
  png_set_filter(png, 0, PNG_ALL_FILTERS);
  png_write_info(png, info);
  const std::size_t stride = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
  for (int row = 0; row < height; ++row) png_write_row(png, pixels + static_cast<std::size_t>(row) * stride);
  png_write_end(png, nullptr);
  return true;
}

/// libjpeg's error handling: it must not return from error_exit, and the default one ends the process.
struct JpegErrors {
  jpeg_error_mgr manager;
  std::jmp_buf jump;
};

void leave_jpeg(j_common_ptr info) { std::longjmp(reinterpret_cast<JpegErrors*>(info->err)->jump, 1); }

/// As above, nothing with a destructor. `bytes` belong to malloc.
bool write_jpeg(jpeg_compress_struct* info, JpegErrors* errors, const GrayPicture* picture, unsigned char** bytes,
                unsigned long* size) {
  constexpr int kQuality = 75;
  info->err = jpeg_std_error(&errors->manager);
  errors->manager.error_exit = leave_jpeg;
  if (setjmp(errors->jump) != 0) return false;
  jpeg_create_compress(info);
  jpeg_mem_dest(info, bytes, size);
  info->image_width = static_cast<JDIMENSION>(picture->width);
  info->image_height = static_cast<JDIMENSION>(picture->height);
  info->input_components = 1;
  info->in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(info);
  info->dct_method = JDCT_ISLOW;  // integers: the same bytes everywhere
  jpeg_set_quality(info, kQuality, TRUE);
  jpeg_start_compress(info, TRUE);
  while (info->next_scanline < info->image_height) {
    // libjpeg only reads the row, but does not say so.
    auto* row = const_cast<JSAMPROW>(picture->pixels.data()) +
                static_cast<std::size_t>(info->next_scanline) * static_cast<std::size_t>(picture->width);
    jpeg_write_scanlines(info, &row, 1);
  }
  jpeg_finish_compress(info);
  return true;
}

std::vector<std::byte> encode(std::span<const std::uint8_t> pixels, int width, int height, int channels) {
  constexpr int kSideMax = 16384;
  std::vector<std::byte> out;
  const bool plausible = width > 0 && height > 0 && width <= kSideMax && height <= kSideMax;
  if (!plausible || pixels.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                                         static_cast<std::size_t>(channels)) {
    return out;
  }
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  if (png == nullptr) return out;
  png_infop info = png_create_info_struct(png);
  if (info == nullptr || !write_png(png, info, pixels.data(), width, height, channels, &out)) out.clear();
  png_destroy_write_struct(&png, &info);
  return out;
}

}  // namespace

std::vector<std::byte> encode_png(const GrayPicture& picture) {
  return encode(picture.pixels, picture.width, picture.height, 1);
}

std::vector<std::byte> encode_png(const RgbPicture& picture) {
  return encode(picture.pixels, picture.width, picture.height, 3);
}

std::vector<std::byte> encode_jpeg(const GrayPicture& picture) {
  std::vector<std::byte> out;
  const bool whole =
      picture.width > 0 && picture.height > 0 && picture.width <= JPEG_MAX_DIMENSION &&
      picture.height <= JPEG_MAX_DIMENSION &&
      picture.pixels.size() == static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
  if (!whole) return out;
  jpeg_compress_struct info{};
  JpegErrors errors{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  if (write_jpeg(&info, &errors, &picture, &bytes, &size)) {
    const auto* first = reinterpret_cast<const std::byte*>(bytes);
    out.assign(first, first + size);
  }
  jpeg_destroy_compress(&info);
  std::free(bytes);
  return out;
}

std::string base64(std::span<const std::byte> bytes) {
  constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t j = 0; j < 3; ++j)
      group = group << 8 | (j < count ? std::to_integer<std::uint32_t>(bytes[i + j]) : 0);
    for (std::size_t j = 0; j < 4; ++j) text += j <= count ? kAlphabet[group >> (18 - 6 * j) & 63] : '=';
  }
  return text;
}

GrayPicture shrink(const GrayPicture& picture, int width_max, double& scale) {
  const int block = std::max(1, (picture.width + width_max - 1) / std::max(1, width_max));
  scale = 1.0 / block;
  if (block == 1) return picture;
  GrayPicture small{picture.width / block, picture.height / block, {}};
  small.pixels.reserve(static_cast<std::size_t>(small.width) * static_cast<std::size_t>(small.height));
  for (int row = 0; row < small.height; ++row) {
    for (int column = 0; column < small.width; ++column) {
      int sum = 0;
      for (int y = row * block; y < (row + 1) * block; ++y) {
        const std::size_t line = static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width);
        for (int x = column * block; x < (column + 1) * block; ++x) {
          sum += picture.pixels[line + static_cast<std::size_t>(x)];
        }
      }
      small.pixels.push_back(static_cast<std::uint8_t>((sum + block * block / 2) / (block * block)));
    }
  }
  return small;
}

}  // namespace firstlook
