/// What notices that the loop no longer turns.
#pragma once

#include <cstdint>

#include "platform/core/time.hpp"

namespace firstlook {

/// Fed by the loop alone, after a full turn.
class Watchdog {
 public:
  virtual ~Watchdog() = default;
  /// Never blocks or allocates.
  virtual void feed(Instant now) = 0;
};

/// Counts and remembers: for tests and for runs without a service manager.
class CountingWatchdog final : public Watchdog {
 public:
  void feed(Instant now) override {
    ++turns_;
    last_ = now;
  }
  [[nodiscard]] std::uint64_t turns() const { return turns_; }
  [[nodiscard]] Instant last() const { return last_; }

 private:
  std::uint64_t turns_ = 0;
  Instant last_{};
};

}  // namespace firstlook
