#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <iterator>

#include "app/dataset/mapping_dataset.hpp"

namespace firstlook {
namespace {

constexpr png_uint_32 kEdgeMax_px = 8192;

// libpng's state. It reports errors by longjmp: functions that call it hold nothing with a destructor.
struct Decoder {
  std::vector<char> bytes;
  std::size_t offset = 0;
  std::array<char, 96> message{};
  png_structp png = nullptr;
  png_infop info = nullptr;

  Decoder() = default;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;
  ~Decoder() { png_destroy_read_struct(&png, &info, nullptr); }
};

void on_error(png_structp png, png_const_charp message) {
  auto* decoder = static_cast<Decoder*>(png_get_error_ptr(png));
  std::strncpy(decoder->message.data(), message, decoder->message.size() - 1);
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

void on_read(png_structp png, png_bytep out, std::size_t size) {
  auto* decoder = static_cast<Decoder*>(png_get_io_ptr(png));
  if (size > decoder->bytes.size() - decoder->offset) png_error(png, "the file is cut short");
  std::memcpy(out, decoder->bytes.data() + decoder->offset, size);
  decoder->offset += size;
}

bool read_header(Decoder& decoder) {
  decoder.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &decoder, on_error, on_warning);
  if (decoder.png == nullptr) return false;
  if (setjmp(png_jmpbuf(decoder.png)) != 0) return false;
  decoder.info = png_create_info_struct(decoder.png);
  png_set_user_limits(decoder.png, kEdgeMax_px, kEdgeMax_px);
  png_set_read_fn(decoder.png, &decoder, on_read);
  png_read_info(decoder.png, decoder.info);
  if (png_get_bit_depth(decoder.png, decoder.info) != 16 ||
      png_get_color_type(decoder.png, decoder.info) != PNG_COLOR_TYPE_GRAY)
    png_error(decoder.png, "not a 16-bit grey picture");
  return true;
}

bool read_rows(Decoder& decoder, std::uint16_t* pixels, std::size_t width, std::size_t height) {
  if (setjmp(png_jmpbuf(decoder.png)) != 0) return false;
  if constexpr (std::endian::native == std::endian::little) png_set_swap(decoder.png);
  const int passes = png_set_interlace_handling(decoder.png);
  png_read_update_info(decoder.png, decoder.info);
  for (int pass = 0; pass < passes; ++pass)
    for (std::size_t row = 0; row < height; ++row)
      png_read_row(decoder.png, reinterpret_cast<png_bytep>(pixels + row * width), nullptr);
  png_read_end(decoder.png, nullptr);
  return true;
}

}  // namespace

Result<DepthPixels> read_depth_png(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || !std::filesystem::is_regular_file(file))
    return failure(Fault::kDataMissing, "{}: no such file", file.string());
  Decoder decoder;
  decoder.bytes.assign(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  DepthPixels image;
  bool ok = read_header(decoder);
  if (ok) {
    image.width = static_cast<int>(png_get_image_width(decoder.png, decoder.info));
    image.height = static_cast<int>(png_get_image_height(decoder.png, decoder.info));
    image.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
    ok = read_rows(decoder, image.pixels.data(), static_cast<std::size_t>(image.width),
                   static_cast<std::size_t>(image.height));
  }
  if (!ok) return failure(Fault::kDataMalformed, "{}: {}", file.string(), decoder.message.data());
  return image;
}

}  // namespace firstlook
