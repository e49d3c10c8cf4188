/// A text with a capacity known at compile time: no allocation, cut when it is too long.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstddef>
#include <string_view>
#include <utility>

namespace firstlook {

/// Up to N bytes. Trivially copyable.
template <std::size_t N>
class FixedText {
 public:
  FixedText() = default;
  FixedText(std::string_view text) { set("{}", text); }  // NOLINT: reads like a text

  template <typename... Args>
  void set(fmt::format_string<Args...> format, Args&&... args) {
    const auto result = fmt::format_to_n(bytes_.data(), N, format, std::forward<Args>(args)...);
    size_ = result.size < N ? result.size : N;
  }
  void clear() { size_ = 0; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] std::string_view view() const { return {bytes_.data(), size_}; }
  operator std::string_view() const { return view(); }  // NOLINT: reads like a text
  bool operator==(const FixedText& other) const { return view() == other.view(); }

 private:
  std::array<char, N> bytes_{};
  std::size_t size_ = 0;
};

}  // namespace firstlook
