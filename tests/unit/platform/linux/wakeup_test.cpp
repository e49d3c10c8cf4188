#include "platform/linux/wakeup.hpp"

#include <catch2/catch.hpp>

#include "platform/linux/thread.hpp"

using namespace firstlook;

namespace {
constexpr std::int64_t kMinute = 60'000'000'000;  // long enough that only wake() can have ended the wait
}

TEST_CASE("wake() ends a wait, also the one that comes after it, and only one") {
  Wakeup wakeup;
  const std::int64_t start = monotonic_ns();
  wakeup.wake();
  wakeup.wake();
  wakeup.wait_until(start + kMinute);
  {
    const Thread waker("waker", [&wakeup] { wakeup.wake(); });
    wakeup.wait_until(start + kMinute);
  }
  CHECK(monotonic_ns() < start + kMinute);
  const std::int64_t until = monotonic_ns() + 5'000'000;
  wakeup.wait_until(until);
  CHECK(monotonic_ns() >= until);
}

TEST_CASE("a wait for the past returns at once") {
  Wakeup wakeup;
  const std::int64_t start = monotonic_ns();
  wakeup.wait_until(start - 1);
  wakeup.wait_until(0);
  wakeup.wait_until(-5);
  CHECK(monotonic_ns() < start + kMinute);
}
