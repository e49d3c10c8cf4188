#include "platform/loop/clock.hpp"

#include <catch2/catch.hpp>

using namespace firstlook;

TEST_CASE("the virtual clock jumps forward only") {
  VirtualClock clock;
  CHECK(clock.now() == Instant{});
  clock.sleep_until(Instant{500});
  clock.sleep_until(Instant{300});
  CHECK(clock.now() == Instant{500});
}

TEST_CASE("the real clock waits until the instant, and not at all for the past") {
  RealClock clock;
  const Instant until = clock.now() + milliseconds(20);
  clock.sleep_until(until);
  CHECK(clock.now() >= until);
  clock.sleep_until(Instant{});
  clock.sleep_until(Instant{-5});
  SUCCEED();
}
