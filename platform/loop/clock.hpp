/// The two clocks of the loop: one that jumps to the next event, one that waits for it.
#pragma once

#include "platform/core/time.hpp"
#include "platform/linux/wakeup.hpp"

namespace firstlook {

/// Time since the start of the loop. now() and sleep_until() from the loop thread.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual Instant now() const = 0;
  /// Returns at `until` or earlier, when wake() was called or a signal came. In the past: returns at once.
  virtual void sleep_until(Instant until) = 0;
  /// Ends a sleep, or the next one; from any thread, never blocks.
  virtual void wake() noexcept = 0;
  /// True when time passes only in sleep_until().
  [[nodiscard]] virtual bool is_virtual() const = 0;
};

/// Jumps to the instant asked for and never goes back.
class VirtualClock final : public Clock {
 public:
  [[nodiscard]] Instant now() const override { return now_; }
  void sleep_until(Instant until) override {
    if (until > now_) now_ = until;
  }
  void wake() noexcept override {}
  [[nodiscard]] bool is_virtual() const override { return true; }

 private:
  Instant now_{};
};

/// The monotonic clock of the computer, 0 at construction.
class RealClock final : public Clock {
 public:
  RealClock() : start_ns_(monotonic_ns()) {}
  [[nodiscard]] Instant now() const override { return {monotonic_ns() - start_ns_}; }
  void sleep_until(Instant until) override;
  void wake() noexcept override { wakeup_.wake(); }
  [[nodiscard]] bool is_virtual() const override { return false; }

 private:
  Wakeup wakeup_;
  std::int64_t start_ns_;
};

}  // namespace firstlook
