#include "hal/v4l2/jpeg_pixels.hpp"

#include <csetjmp>
#include <cstdio>
// jpeglib.h needs <cstdio> before it.
#include <jpeglib.h>

namespace firstlook::v4l2 {
namespace {

/// libjpeg's error handling: it must not return from error_exit. The first warning ends the reading, too: a picture cut
/// short is only a warning to libjpeg.
struct Errors {
  jpeg_error_mgr manager;
  std::jmp_buf out;
};

void leave(j_common_ptr info) { std::longjmp(reinterpret_cast<Errors*>(info->err)->out, 1); }
void leave_at_warning(j_common_ptr info, int level) {
  if (level < 0) leave(info);
}

enum class Outcome : std::uint8_t { kDone, kBroken, kOtherSize };

/// Rows one after the other into `pixels`. Nothing in here has a destructor: longjmp passes over it.
Outcome decode(std::span<const std::uint8_t> jpeg, J_COLOR_SPACE space, std::uint8_t* pixels, int width, int height,
               int channels, jpeg_decompress_struct* info, Errors* errors) {
  info->err = jpeg_std_error(&errors->manager);
  errors->manager.error_exit = leave;
  errors->manager.emit_message = leave_at_warning;
  if (setjmp(errors->out) != 0) {
    jpeg_destroy_decompress(info);
    return Outcome::kBroken;
  }
  jpeg_create_decompress(info);
  jpeg_mem_src(info, jpeg.data(), static_cast<unsigned long>(jpeg.size()));
  jpeg_read_header(info, TRUE);
  if (static_cast<int>(info->image_width) != width || static_cast<int>(info->image_height) != height) {
    jpeg_destroy_decompress(info);
    return Outcome::kOtherSize;
  }
  info->out_color_space = space;
  jpeg_start_decompress(info);
  while (info->output_scanline < info->output_height) {
    JSAMPROW row =
        pixels + static_cast<std::size_t>(info->output_scanline) * static_cast<std::size_t>(width * channels);
    jpeg_read_scanlines(info, &row, 1);
  }
  jpeg_finish_decompress(info);
  jpeg_destroy_decompress(info);
  return Outcome::kDone;
}

Status decoded(std::span<const std::uint8_t> jpeg, J_COLOR_SPACE space, std::uint8_t* pixels, int width, int height,
               int channels) {
  if (jpeg.empty()) return failure(Fault::kFrameRefused, "an empty picture");
  jpeg_decompress_struct info{};
  Errors errors{};
  switch (decode(jpeg, space, pixels, width, height, channels, &info, &errors)) {
    case Outcome::kDone:
      return {};
    case Outcome::kOtherSize:
      return failure(Fault::kFrameRefused, "the camera's JPEG is not {} x {}", width, height);
    case Outcome::kBroken:
      break;
  }
  return failure(Fault::kFrameRefused, "the camera's JPEG of {} bytes is broken", jpeg.size());
}

}  // namespace

Status jpeg_to_gray(std::span<const std::uint8_t> jpeg, MutableGrayImage image) {
  return decoded(jpeg, JCS_GRAYSCALE, image.data, image.width, image.height, 1);
}

Status jpeg_to_rgb(std::span<const std::uint8_t> jpeg, ImageView<std::array<std::uint8_t, 3>> image) {
  return decoded(jpeg, JCS_RGB, image.data->data(), image.width, image.height, 3);
}

}  // namespace firstlook::v4l2
