#include "algorithms/mapping/log_odds_update.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

constexpr std::size_t kWordBits = 64;
constexpr std::size_t kLanes = 32;

// One AVX2 register of voxels, or what the compiler makes of it elsewhere; the same bits.
using Voxels [[gnu::vector_size(kLanes)]] = std::int8_t;

/// Eight bits as eight bytes of 0 or 255.
constexpr auto kSpread = [] {
  std::array<std::uint64_t, 256> spread{};
  for (std::size_t bits = 0; bits < spread.size(); ++bits) {
    for (unsigned i = 0; i < 8; ++i) {
      if ((bits >> i & 1) != 0) spread[bits] |= 0xFFULL << (8 * i);
    }
  }
  return spread;
}();
static_assert(std::endian::native == std::endian::little);

[[gnu::always_inline]] inline void spread(std::uint32_t bits, Voxels& mask) {
  std::array<std::uint64_t, 4> bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = kSpread[bits >> (8 * i) & 0xFF];
  std::memcpy(&mask, bytes.data(), sizeof(mask));
}

/// Updates 32 voxels; one is taken off `discovered` for each that was unknown.
[[gnu::always_inline]] inline void update_lanes(std::uint32_t missed, std::uint32_t hit, std::int8_t* log_odds,
                                                Voxels& discovered) {
  Voxels value, misses, hits;
  std::memcpy(&value, log_odds, sizeof(value));
  spread(missed, misses);
  spread(hit, hits);
  const Voxels unknown = value == kUnknownLogOdds;
  const Voxels before = unknown ? Voxels{} : value;
  Voxels free = before + static_cast<std::int8_t>(kMissLogOdds);
  free = free < static_cast<std::int8_t>(kLogOddsMin) ? Voxels{} + static_cast<std::int8_t>(kLogOddsMin) : free;
  Voxels occupied = before + static_cast<std::int8_t>(kHitLogOdds);
  occupied =
      occupied > static_cast<std::int8_t>(kLogOddsMax) ? Voxels{} + static_cast<std::int8_t>(kLogOddsMax) : occupied;
  discovered += unknown & (misses | hits);
  value = hits ? occupied : misses ? free : value;
  std::memcpy(log_odds, &value, sizeof(value));
}

using Words = std::span<const std::uint64_t>;

/// Whole words only.
[[gnu::always_inline]] inline FrameChange update_words(Words missed, Words hit, std::int8_t* log_odds) {
  constexpr int kWordsMax = 60;  // before a lane of `found` could overflow: two for each word
  FrameChange change;
  Voxels found{};
  int words = 0;
  const auto collect = [&] {
    for (std::size_t i = 0; i < kLanes; ++i) change.voxels_discovered += static_cast<std::size_t>(-found[i]);
    found = Voxels{};
    words = 0;
  };
  for (std::size_t word = 0; word < missed.size(); ++word) {
    const std::uint64_t hits = hit[word], misses = missed[word] & ~hits;
    if ((misses | hits) == 0) continue;
    change.voxels_missed += static_cast<std::size_t>(std::popcount(misses));
    change.voxels_hit += static_cast<std::size_t>(std::popcount(hits));
    std::int8_t* voxels = log_odds + word * kWordBits;
    update_lanes(static_cast<std::uint32_t>(misses), static_cast<std::uint32_t>(hits), voxels, found);
    update_lanes(static_cast<std::uint32_t>(misses >> 32), static_cast<std::uint32_t>(hits >> 32), voxels + kLanes,
                 found);
    if (++words == kWordsMax) collect();
  }
  collect();
  return change;
}
FIRSTLOOK_AVX2 FrameChange update_avx2(Words missed, Words hit, std::int8_t* log_odds) {
  return update_words(missed, hit, log_odds);
}
FrameChange update_portable(Words missed, Words hit, std::int8_t* log_odds) {
  return update_words(missed, hit, log_odds);
}
FrameChange update(Words missed, Words hit, std::int8_t* log_odds) {
  return has_avx2() ? update_avx2(missed, hit, log_odds) : update_portable(missed, hit, log_odds);
}

}  // namespace

FrameChange update_log_odds(Words missed, Words hit, std::span<std::int8_t> log_odds) {
  const std::size_t whole = log_odds.size() / kWordBits, rest = log_odds.size() % kWordBits;
  FrameChange change = update(missed.first(whole), hit.first(whole), log_odds.data());
  if (rest == 0 || missed.size() == whole) return change;
  // The last word reaches beyond the grid.
  std::array<std::int8_t, kWordBits> last{};
  const auto tail = log_odds.last(rest);
  std::copy(tail.begin(), tail.end(), last.begin());
  const FrameChange end = update(missed.subspan(whole), hit.subspan(whole), last.data());
  std::copy_n(last.begin(), rest, tail.begin());
  change.voxels_missed += end.voxels_missed;
  change.voxels_hit += end.voxels_hit;
  change.voxels_discovered += end.voxels_discovered;
  return change;
}

}  // namespace firstlook
