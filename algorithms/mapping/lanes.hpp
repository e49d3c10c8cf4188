/// Eight numbers side by side: one AVX2 register, or what the compiler makes of it elsewhere; the same bits. For bodies
/// of functions that exist twice, with FIRSTLOOK_AVX2 and without. Internal to algorithms/mapping.
#pragma once

#include <cstdint>
#include <cstring>

namespace firstlook::lanes {

inline constexpr int kLanes = 8;
using Floats [[gnu::vector_size(32)]] = float;
using Ints [[gnu::vector_size(32)]] = std::int32_t;
inline constexpr Floats kCounting = {0, 1, 2, 3, 4, 5, 6, 7};

/// One bit for each lane of a comparison, the first one lowest.
[[gnu::always_inline]] inline unsigned bits_of(const Ints& mask) {
  constexpr Ints kBits = {1, 2, 4, 8, 16, 32, 64, 128};
  const Ints bits = mask & kBits;
  std::int32_t parts[kLanes];
  std::memcpy(parts, &bits, sizeof(parts));
  std::int32_t all = 0;
  for (const std::int32_t part : parts) all |= part;
  return static_cast<unsigned>(all);
}
[[gnu::always_inline]] inline bool any(const Ints& mask) {
  std::int64_t parts[kLanes / 2];
  std::memcpy(parts, &mask, sizeof(parts));
  return (parts[0] | parts[1] | parts[2] | parts[3]) != 0;
}
template <typename T, typename Lanes>
[[gnu::always_inline]] inline void gather(const T* from, const Ints& at, Lanes& out) {
  for (int i = 0; i < kLanes; ++i) out[i] = from[at[i]];
}

}  // namespace firstlook::lanes
