/// Time as a value. Nothing outside platform/loop asks a clock; an Instant is an argument.
#pragma once

#include <compare>
#include <cstdint>

namespace firstlook {

/// A span of time in whole nanoseconds.
struct Duration {
  std::int64_t ns = 0;
  [[nodiscard]] constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
  constexpr auto operator<=>(const Duration&) const = default;
};

/// A point in time: nanoseconds since the program's loop started (virtual or monotonic clock).
struct Instant {
  std::int64_t ns = 0;
  [[nodiscard]] constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
  constexpr auto operator<=>(const Instant&) const = default;
};

constexpr Duration seconds(double s) { return {static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5))}; }
constexpr Duration milliseconds(std::int64_t ms) { return {ms * 1'000'000}; }
constexpr Duration operator-(Instant a, Instant b) { return {a.ns - b.ns}; }
constexpr Instant operator+(Instant a, Duration d) { return {a.ns + d.ns}; }
constexpr Instant operator-(Instant a, Duration d) { return {a.ns - d.ns}; }
constexpr Duration operator+(Duration a, Duration b) { return {a.ns + b.ns}; }
constexpr Duration operator*(Duration a, std::int64_t n) { return {a.ns * n}; }

}  // namespace firstlook
