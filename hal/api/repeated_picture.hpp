/// Whether a depth camera hangs: such a one may go on sending its last picture with new stamps.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>

#include "platform/journal/journal.hpp"

namespace firstlook::hal {

/// Noise keeps a living camera from repeating a picture, but not from repeating the few pixels that a view into the
/// open returns: those prove nothing.
class RepeatedPicture {
 public:
  /// Whether this is, pixel for pixel, the picture that was asked about before, and another frame. 1 ms for 640x480.
  /// @param pixels  of depth; 0 means no return
  [[nodiscard]] bool repeats(std::uint32_t sequence, std::span<const std::uint16_t> pixels) {
    constexpr std::ptrdiff_t kTellingShare = 100;  // one pixel of so many: 3072 of 640x480
    Fnv1a hash;
    hash.add(std::as_bytes(pixels));
    const auto returns = std::count_if(pixels.begin(), pixels.end(), [](std::uint16_t z) { return z != 0; });
    const bool tells = returns * kTellingShare >= std::ssize(pixels);
    const bool same = last_ && last_->hash == hash.value() && last_->sequence != sequence;
    last_ = {sequence, hash.value()};
    return tells && same;
  }

 private:
  struct Picture {
    std::uint32_t sequence = 0;
    std::uint64_t hash = 0;
  };
  std::optional<Picture> last_;
};

}  // namespace firstlook::hal
