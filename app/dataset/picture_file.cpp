/// The adapter to libpng and libjpeg: their types and error handling end here.
#include "app/dataset/picture_file.hpp"

#include <png.h>

#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>
#include <new>

// jpeglib.h needs <cstdio> before it.
#include <jpeglib.h>

namespace firstlook {
namespace {

constexpr unsigned kSideMax_px = 8192;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

/// Bytes of pixels, one or three each.
struct Picture {
  std::vector<std::uint8_t> bytes;
  unsigned width = 0;
  unsigned height = 0;
};

enum class Channels : unsigned { kGray = 1, kColor = 3 };

Picture make_picture(unsigned width, unsigned height, Channels channels) {
  return {std::vector<std::uint8_t>(static_cast<std::size_t>(width) * height * static_cast<unsigned>(channels)), width,
          height};
}

Result<Picture> refuse_size(const std::string& name, unsigned width, unsigned height) {
  return failure(Fault::kDataMalformed, "{}: a picture of {}x{} pixels, at most {} each way", name, width, height,
                 kSideMax_px);
}

Result<Picture> read_png(const std::filesystem::path& file, Channels channels) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, file.c_str()) == 0) {
    return failure(Fault::kDataMalformed, "{}: {}", file.string(), png.message);
  }
  if (png.width > kSideMax_px || png.height > kSideMax_px) {
    png_image_free(&png);
    return refuse_size(file.string(), png.width, png.height);
  }
  png.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;  // 16-bit values are cut to 8 bits, not converted from linear light
  png.format = channels == Channels::kGray ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  Picture picture = make_picture(png.width, png.height, channels);
  const png_color black{0, 0, 0};  // under what is transparent
  if (png_image_finish_read(&png, &black, picture.bytes.data(), 0, nullptr) == 0) {
    return failure(Fault::kDataMalformed, "{}: {}", file.string(), png.message);
  }
  return picture;
}

/// libjpeg's error handling: it must not return from error_exit.
struct JpegErrors {
  jpeg_error_mgr manager;
  std::jmp_buf jump;
  std::array<char, JMSG_LENGTH_MAX> text;
};

void leave_jpeg(j_common_ptr info) {
  auto* errors = reinterpret_cast<JpegErrors*>(info->err);
  info->err->format_message(info, errors->text.data());
  std::longjmp(errors->jump, 1);
}

/// The first warning ends the reading too: a picture cut short is only a warning to libjpeg.
void leave_jpeg_at_warning(j_common_ptr info, int level) {
  if (level < 0) leave_jpeg(info);
}

void keep_silent(j_common_ptr) {}

enum class JpegOutcome { kRead, kBroken, kTooLarge };

/// No object with a destructor lives here: errors jump out of the middle of it.
JpegOutcome decode_jpeg(std::FILE* stream, Channels channels, jpeg_decompress_struct* info, JpegErrors* errors,
                        Picture* picture) {
  info->err = jpeg_std_error(&errors->manager);
  errors->manager.error_exit = leave_jpeg;
  errors->manager.emit_message = leave_jpeg_at_warning;
  errors->manager.output_message = keep_silent;
  if (setjmp(errors->jump) != 0) return JpegOutcome::kBroken;
  jpeg_create_decompress(info);
  jpeg_stdio_src(info, stream);
  jpeg_read_header(info, TRUE);
  info->out_color_space = channels == Channels::kGray ? JCS_GRAYSCALE : JCS_RGB;
  if (info->image_width > kSideMax_px || info->image_height > kSideMax_px) return JpegOutcome::kTooLarge;
  jpeg_start_decompress(info);
  *picture = make_picture(info->output_width, info->output_height, channels);
  const std::size_t row_bytes = static_cast<std::size_t>(info->output_width) * static_cast<unsigned>(channels);
  while (info->output_scanline < info->output_height) {
    JSAMPROW row = picture->bytes.data() + info->output_scanline * row_bytes;
    jpeg_read_scanlines(info, &row, 1);
  }
  jpeg_finish_decompress(info);
  return JpegOutcome::kRead;
}

Result<Picture> read_jpeg(const std::filesystem::path& file, std::FILE* stream, Channels channels) {
  jpeg_decompress_struct info{};
  JpegErrors errors{};
  Picture picture;
  const JpegOutcome outcome = decode_jpeg(stream, channels, &info, &errors, &picture);
  const unsigned width = info.image_width, height = info.image_height;
  jpeg_destroy_decompress(&info);
  if (outcome == JpegOutcome::kTooLarge) return refuse_size(file.string(), width, height);
  if (outcome == JpegOutcome::kBroken) {
    return failure(Fault::kDataMalformed, "{}: {}", file.string(), errors.text.data());
  }
  return picture;
}

Result<Picture> read_picture(const std::filesystem::path& file, Channels channels) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return failure(Fault::kDataMissing, "{}: no such file", file.string());
  }
  const File stream(std::fopen(file.c_str(), "rb"));
  if (!stream) return failure(Fault::kDataMissing, "{}: cannot be opened", file.string());
  std::array<std::uint8_t, 8> start{};
  const std::size_t read = std::fread(start.data(), 1, start.size(), stream.get());
  if (std::fseek(stream.get(), 0, SEEK_SET) != 0) {
    return failure(Fault::kDataMissing, "{}: cannot be read from its start", file.string());
  }
  try {
    if (read == start.size() && png_sig_cmp(start.data(), 0, start.size()) == 0) return read_png(file, channels);
    if (read > 2 && start[0] == 0xFF && start[1] == 0xD8) return read_jpeg(file, stream.get(), channels);
  } catch (const std::bad_alloc&) {
    return failure(Fault::kOutOfMemory, "{}: reading the picture", file.string());
  }
  return failure(Fault::kDataMalformed, "{}: neither PNG nor JPEG", file.string());
}

}  // namespace

Result<GrayPixels> read_gray_image(const std::filesystem::path& file) {
  Result<Picture> picture = read_picture(file, Channels::kGray);
  if (!picture) return std::unexpected(picture.error());
  return GrayPixels{std::move(picture->bytes), static_cast<int>(picture->width), static_cast<int>(picture->height)};
}

Result<ColorPixels> read_color_image(const std::filesystem::path& file) {
  const Result<Picture> picture = read_picture(file, Channels::kColor);
  if (!picture) return std::unexpected(picture.error());
  ColorPixels colors{{}, static_cast<int>(picture->width), static_cast<int>(picture->height)};
  colors.pixels.resize(picture->bytes.size() / 3);
  std::memcpy(colors.pixels.data(), picture->bytes.data(), picture->bytes.size());
  return colors;
}

}  // namespace firstlook
