/// Random numbers that belong to a pixel: the same whatever was drawn before, so the order of rendering does not
/// matter.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "platform/core/random.hpp"

namespace firstlook::sim {

/// 64 bits for one use of one frame's pixel `index`.
class PixelNoise {
 public:
  PixelNoise(std::uint64_t seed, std::uint64_t frame, std::uint64_t use)
      : key_(mix64(mix64(mix64(seed) ^ frame) + use)) {}
  [[nodiscard]] std::uint64_t bits(std::size_t index) const { return mix64(key_ + 0x9e3779b97f4a7c15ULL * index); }

 private:
  std::uint64_t key_;
};

/// A normal number (mean 0, standard deviation 1, cut at 3.7) from the low 24 bits, by its quantile function.
[[nodiscard]] float normal_of(std::uint64_t bits);

/// [0, 1) from 16 of the 64 bits: part 0 takes bits 0..15 and so on. Parts 2 and 3 are independent of normal_of.
[[nodiscard]] constexpr float uniform_of(std::uint64_t bits, int part) {
  return static_cast<float>((bits >> (16 * part)) & 0xffffU) * (1.0F / 65536.0F);
}

}  // namespace firstlook::sim
