#include "platform/journal/journal.hpp"

#include <fmt/format.h>

#include <array>

#include "platform/journal/archive.hpp"

namespace firstlook {
namespace {

constexpr std::array<std::uint32_t, 256> make_crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint32_t c = i;
    for (int bit = 0; bit < 8; ++bit) c = (c & 1) != 0 ? 0xedb88320U ^ (c >> 1) : c >> 1;
    table[i] = c;
  }
  return table;
}
constexpr std::array<std::uint32_t, 256> kCrcTable = make_crc_table();

}  // namespace

std::uint32_t crc32(std::uint32_t crc, std::span<const std::byte> bytes) {
  crc = ~crc;
  for (const std::byte b : bytes) crc = kCrcTable[(crc ^ static_cast<std::uint32_t>(b)) & 0xff] ^ (crc >> 8);
  return ~crc;
}

void DecisionsHash::add(std::uint16_t kind, Instant time, std::span<const std::byte> payload) {
  std::array<std::byte, 14> head;
  ByteWriter writer(head);
  writer(kind, time, static_cast<std::uint32_t>(payload.size()));
  hash_.add(head);
  hash_.add(payload);
}

std::string hash_text(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

}  // namespace firstlook
