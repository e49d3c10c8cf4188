/// Bytes in fixed memory: messages that are built, and what a connection has brought and nobody has read yet.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

#include "platform/core/ensure.hpp"

namespace firstlook::ur {

/// A message under construction, numbers big-endian. Too long a message is a programmer error.
template <std::size_t N>
class Message {
 public:
  void number(std::uint64_t value, int bytes) {
    for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) byte(static_cast<char>(value >> shift));
  }
  void real(double value) { number(std::bit_cast<std::uint64_t>(value), 8); }
  void text(std::string_view words) {
    for (const char c : words) byte(c);
  }
  void byte(char value) {
    ENSURE(5391, size_ < N);
    bytes_[size_++] = value;
  }
  [[nodiscard]] std::string_view view() const { return {bytes_.data(), size_}; }

 private:
  std::array<char, N> bytes_{};
  std::size_t size_ = 0;
};

/// What has come and is not used up, in order.
template <std::size_t N>
class Inbox {
 public:
  void clear() { begin_ = end_ = 0; }
  [[nodiscard]] std::string_view view() const { return {bytes_.data() + begin_, end_ - begin_}; }
  void use_up(std::size_t count) { begin_ = std::min(end_, begin_ + count); }
  /// Where the next bytes may be put; `came` says how many were. Empty: N bytes wait.
  [[nodiscard]] std::span<char> room() {
    if (begin_ > 0) {
      std::memmove(bytes_.data(), bytes_.data() + begin_, end_ - begin_);
      end_ -= begin_;
      begin_ = 0;
    }
    return {bytes_.data() + end_, N - end_};
  }
  void came(std::size_t count) {
    ENSURE(5392, end_ + count <= N);
    end_ += count;
  }

 private:
  std::array<char, N> bytes_;
  std::size_t begin_ = 0, end_ = 0;
};

/// The big-endian number in `count` bytes from `at` on. The caller has looked at the size.
[[nodiscard]] inline std::uint64_t number_at(std::string_view bytes, std::size_t at, std::size_t count) {
  ENSURE(5393, at + count <= bytes.size());
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | static_cast<std::uint8_t>(bytes[at + i]);
  return value;
}
[[nodiscard]] inline std::int32_t integer_at(std::string_view bytes, std::size_t at) {
  return static_cast<std::int32_t>(number_at(bytes, at, 4));
}
[[nodiscard]] inline double real_at(std::string_view bytes, std::size_t at) {
  return std::bit_cast<double>(number_at(bytes, at, 8));
}

}  // namespace firstlook::ur
