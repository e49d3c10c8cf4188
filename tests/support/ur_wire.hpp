/// A client's side of UR's interfaces, byte by byte and on its own: tests do not use the simulation's code to read it.
#pragma once

#include <bit>
#include <catch2/catch.hpp>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace firstlook::test {

[[nodiscard]] inline std::string big_endian(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text.push_back(static_cast<char>(value >> (8 * i)));
  return text;
}
[[nodiscard]] inline std::string big_endian(double value) { return big_endian(std::bit_cast<std::uint64_t>(value), 8); }

[[nodiscard]] inline std::uint64_t unsigned_at(std::string_view bytes, std::size_t at, int count) {
  std::uint64_t value = 0;
  REQUIRE(at + static_cast<std::size_t>(count) <= bytes.size());
  for (int i = 0; i < count; ++i)
    value = value << 8 | static_cast<std::uint8_t>(bytes[at + static_cast<std::size_t>(i)]);
  return value;
}
[[nodiscard]] inline double double_at(std::string_view bytes, std::size_t at) {
  return std::bit_cast<double>(unsigned_at(bytes, at, 8));
}
[[nodiscard]] inline float float_at(std::string_view bytes, std::size_t at) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(unsigned_at(bytes, at, 4)));
}
[[nodiscard]] inline std::int32_t int_at(std::string_view bytes, std::size_t at) {
  return static_cast<std::int32_t>(unsigned_at(bytes, at, 4));
}

/// An RTDE package: u16 size with the header, type, payload.
[[nodiscard]] inline std::string rtde(char type, std::string_view payload = {}) {
  return big_endian(payload.size() + 3, 2) + type + std::string(payload);
}

struct RtdePackage {
  char type = 0;
  std::string payload;
};

/// Takes the whole RTDE packages from the front of `bytes`.
[[nodiscard]] inline std::vector<RtdePackage> take_rtde(std::string& bytes) {
  std::vector<RtdePackage> packages;
  while (bytes.size() >= 3) {
    const std::size_t size = unsigned_at(bytes, 0, 2);
    REQUIRE(size >= 3);
    if (bytes.size() < size) break;
    packages.push_back({bytes[2], bytes.substr(3, size - 3)});
    bytes.erase(0, size);
  }
  return packages;
}

/// A packet of the primary interface, or a sub-package of one: u32 size with the header, u8 type, content.
struct UrPacket {
  int type = 0;
  std::string content;
};
[[nodiscard]] inline std::vector<UrPacket> take_packets(std::string& bytes) {
  std::vector<UrPacket> packets;
  while (bytes.size() >= 5) {
    const std::size_t size = unsigned_at(bytes, 0, 4);
    REQUIRE(size >= 5);
    if (bytes.size() < size) break;
    packets.push_back({static_cast<std::uint8_t>(bytes[4]), bytes.substr(5, size - 5)});
    bytes.erase(0, size);
  }
  return packets;
}

}  // namespace firstlook::test
