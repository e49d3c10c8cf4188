/// Pictures as bytes: PNG and JPEG in memory, and base64 for pages that carry their pictures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "app/report/run_record.hpp"

namespace firstlook {

/// 8-bit grey PNG; the same pixels give the same bytes. Empty for a picture whose size and pixels do not agree.
[[nodiscard]] std::vector<std::byte> encode_png(const GrayPicture& picture);
/// 8-bit RGB PNG, as above.
[[nodiscard]] std::vector<std::byte> encode_png(const RgbPicture& picture);

/// Grey baseline JPEG of quality 75, a fifth of the PNG's size for pictures with a sensor's noise; the same pixels give
/// the same bytes. Empty for a picture whose size and pixels do not agree.
[[nodiscard]] std::vector<std::byte> encode_jpeg(const GrayPicture& picture);

/// Standard alphabet with padding (RFC 4648, section 4).
[[nodiscard]] std::string base64(std::span<const std::byte> bytes);

/// The picture at most `width_max` pixels wide: whole blocks of pixels averaged. @param scale  receives new size / old
[[nodiscard]] GrayPicture shrink(const GrayPicture& picture, int width_max, double& scale);

}  // namespace firstlook
