/// Waiting until an instant or until another thread wakes us: ppoll on an eventfd, one system call each time.
#pragma once

#include <cstdint>

namespace firstlook {

/// Nanoseconds of CLOCK_MONOTONIC.
[[nodiscard]] std::int64_t monotonic_ns();

/// One waiter, any number of wakers. The descriptor is opened at construction; ENSURE 1601 when there is none left.
class Wakeup {
 public:
  Wakeup();
  ~Wakeup();
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;

  /// Returns at `monotonic_ns_until`, or earlier after wake() or a signal. Does not allocate.
  void wait_until(std::int64_t monotonic_ns_until);
  /// From any thread; a call before the wait ends the wait, too.
  void wake() noexcept;

 private:
  int event_ = -1;
};

}  // namespace firstlook
