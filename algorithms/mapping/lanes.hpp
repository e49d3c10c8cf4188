/// Eight numbers side by side: one AVX2 register, or what the compiler makes of it elsewhere; the same bits. For bodies
/// of functions that exist twice, with FIRSTLOOK_AVX2 and without. Internal to algorithms.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace firstlook::lanes {

inline constexpr int kLanes = 8;
using Floats [[gnu::vector_size(32)]] = float;
using Ints [[gnu::vector_size(32)]] = std::int32_t;
inline constexpr Floats kCounting = {0, 1, 2, 3, 4, 5, 6, 7};

/// One bit for each lane of a comparison, the first one lowest.
[[gnu::always_inline]] inline unsigned bits_of(const Ints& mask) {
#if defined(__x86_64__)
  using Half [[gnu::vector_size(16)]] = float;
  Half halves[2];
  std::memcpy(&halves, &mask, sizeof(mask));
  return static_cast<unsigned>(__builtin_ia32_movmskps(halves[0]) | __builtin_ia32_movmskps(halves[1]) << 4);
#else
  unsigned bits = 0;
  for (unsigned i = 0; i < kLanes; ++i) bits |= static_cast<unsigned>(mask[i] != 0) << i;
  return bits;
#endif
}
[[gnu::always_inline]] inline bool any(const Ints& mask) { return bits_of(mask) != 0; }
template <typename T, typename Lanes>
[[gnu::always_inline]] inline void gather(const T* from, const Ints& at, Lanes& out) {
  for (int i = 0; i < kLanes; ++i) out[i] = from[at[i]];
}
/// Three bytes beyond the last one are read.
[[gnu::always_inline]] inline void gather_bytes(const std::uint8_t* from, const Ints& at, Ints& out) {
  for (int i = 0; i < kLanes; ++i) {
    std::int32_t word;
    std::memcpy(&word, from + static_cast<std::uint32_t>(at[i]), sizeof(word));
    out[i] = word;
  }
  out &= 0xFF;
}
/// Eight points, coordinates side by side, as vectors of their coordinates.
[[gnu::always_inline]] inline void load_points(const double* coordinates, Floats (&points)[3]) {
  using Doubles [[gnu::vector_size(64)]] = double;
  Floats part[3];
  for (int i = 0; i < 3; ++i) {
    Doubles eight;
    std::memcpy(&eight, coordinates + kLanes * i, sizeof(eight));
    part[i] = __builtin_convertvector(eight, Floats);
  }
  const Floats x = __builtin_shufflevector(part[0], part[1], 0, 3, 6, 9, 12, 15, 0, 0);
  const Floats y = __builtin_shufflevector(part[0], part[1], 1, 4, 7, 10, 13, 0, 0, 0);
  const Floats z = __builtin_shufflevector(part[0], part[1], 2, 5, 8, 11, 14, 0, 0, 0);
  points[0] = __builtin_shufflevector(x, part[2], 0, 1, 2, 3, 4, 5, 10, 13);
  points[1] = __builtin_shufflevector(y, part[2], 0, 1, 2, 3, 4, 8, 11, 14);
  points[2] = __builtin_shufflevector(z, part[2], 0, 1, 2, 3, 4, 9, 12, 15);
}
/// Where the lanes whose bits are set go first, in their order: for each set of bits.
inline constexpr auto kPackOrders = [] {
  std::array<std::array<std::int32_t, kLanes>, 256> orders{};
  for (unsigned bits = 0; bits < orders.size(); ++bits) {
    std::size_t next = 0;
    for (unsigned lane = 0; lane < kLanes; ++lane) {
      if ((bits >> lane & 1) != 0) orders[bits][next++] = static_cast<std::int32_t>(lane);
    }
  }
  return orders;
}();
/// Writes the lanes whose bits are set side by side; all eight numbers from `out` on are overwritten.
[[gnu::always_inline]] inline void pack(const Ints& x, unsigned bits, std::int32_t* out) {
  Ints order, packed;
  std::memcpy(&order, kPackOrders[bits].data(), sizeof(order));
#if defined(__clang__)
  for (int i = 0; i < kLanes; ++i) packed[i] = x[order[i]];
#else
  packed = __builtin_shuffle(x, order);
#endif
  std::memcpy(out, &packed, sizeof(packed));
}

}  // namespace firstlook::lanes
