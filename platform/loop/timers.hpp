/// Timers by small number: set, cancel, and which is due.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "platform/core/time.hpp"
#include "platform/loop/event.hpp"

namespace firstlook {

/// A fixed set of one-shot timers with the numbers 0 .. 31.
class TimerQueue {
 public:
  static constexpr std::uint32_t kTimersMax = 32;

  TimerQueue() { due_.fill(kNever); }
  /// Starts timer `id`, or moves it when it runs.
  void set(std::uint32_t id, Instant due);
  void cancel(std::uint32_t id);
  [[nodiscard]] bool running(std::uint32_t id) const;
  /// The earliest due time; kNever when no timer runs.
  [[nodiscard]] Instant next_due() const;
  /// Takes the first timer that is due, in order of time, then number. Empty when none is.
  [[nodiscard]] std::optional<std::uint32_t> pop_due(Instant now);

 private:
  std::array<Instant, kTimersMax> due_{};
};

}  // namespace firstlook
