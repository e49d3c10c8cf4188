/// Big-endian numbers, as all interfaces of a UR controller send and take them.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace firstlook::sim::ur {

/// Appends to a string of bytes.
class WireWriter {
 public:
  explicit WireWriter(std::string& out) : out_(out) {}

  void u8(std::uint8_t value) { out_.push_back(static_cast<char>(value)); }
  void i8(std::int8_t value) { u8(static_cast<std::uint8_t>(value)); }
  void flag(bool value) { u8(value ? 1 : 0); }
  void u16(std::uint16_t value) { integer(value); }
  void u32(std::uint32_t value) { integer(value); }
  void i32(std::int32_t value) { integer(static_cast<std::uint32_t>(value)); }
  void u64(std::uint64_t value) { integer(value); }
  void f32(double value) { integer(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
  void f64(double value) { integer(std::bit_cast<std::uint64_t>(value)); }
  void f64s(std::span<const double> values) {
    for (const double value : values) f64(value);
  }
  void text(std::string_view value) { out_.append(value); }
  /// Writes over four bytes that were written before.
  void patch_u32(std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) out_[at + i] = static_cast<char>(value >> (24 - 8 * i));
  }
  void patch_u16(std::size_t at, std::uint16_t value) {
    out_[at] = static_cast<char>(value >> 8);
    out_[at + 1] = static_cast<char>(value);
  }
  [[nodiscard]] std::size_t size() const { return out_.size(); }

 private:
  template <typename T>
  void integer(T value) {
    for (int shift = 8 * static_cast<int>(sizeof(T)) - 8; shift >= 0; shift -= 8) {
      out_.push_back(static_cast<char>(static_cast<std::uint64_t>(value) >> shift));
    }
  }

  std::string& out_;
};

/// Reads from the front. Reading beyond the end gives zeros, and `ok()` is false from then on.
class WireReader {
 public:
  explicit WireReader(std::string_view bytes) : rest_(bytes) {}

  [[nodiscard]] std::uint8_t u8() { return static_cast<std::uint8_t>(integer(1)); }
  [[nodiscard]] std::uint16_t u16() { return static_cast<std::uint16_t>(integer(2)); }
  [[nodiscard]] std::uint32_t u32() { return static_cast<std::uint32_t>(integer(4)); }
  [[nodiscard]] std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  [[nodiscard]] std::uint64_t u64() { return integer(8); }
  [[nodiscard]] double f64() { return std::bit_cast<double>(integer(8)); }
  [[nodiscard]] std::string_view text(std::size_t length) {
    if (rest_.size() < length) {
      ok_ = false;
      length = rest_.size();
    }
    const std::string_view taken = rest_.substr(0, length);
    rest_.remove_prefix(length);
    return taken;
  }
  [[nodiscard]] std::string_view rest() const { return rest_; }
  [[nodiscard]] bool ok() const { return ok_; }

 private:
  [[nodiscard]] std::uint64_t integer(std::size_t bytes) {
    if (rest_.size() < bytes) {
      ok_ = false;
      rest_ = {};
      return 0;
    }
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | static_cast<std::uint8_t>(rest_[i]);
    rest_.remove_prefix(bytes);
    return value;
  }

  std::string_view rest_;
  bool ok_ = true;
};

}  // namespace firstlook::sim::ur
