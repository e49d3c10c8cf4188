#include "platform/loop/timers.hpp"

#include <catch2/catch.hpp>

using namespace firstlook;

TEST_CASE("timers come in order of time, then number") {
  TimerQueue timers;
  CHECK(timers.next_due() == kNever);
  CHECK_FALSE(timers.pop_due(kNever));
  timers.set(7, Instant{20});
  timers.set(3, Instant{20});
  timers.set(31, Instant{10});
  timers.set(0, Instant{30});
  CHECK(timers.next_due() == Instant{10});
  CHECK_FALSE(timers.pop_due(Instant{9}));
  CHECK(timers.pop_due(Instant{25}) == 31U);
  CHECK(timers.pop_due(Instant{25}) == 3U);
  CHECK(timers.pop_due(Instant{25}) == 7U);
  CHECK_FALSE(timers.pop_due(Instant{25}));
  CHECK(timers.next_due() == Instant{30});
}

TEST_CASE("a timer can be moved and cancelled") {
  TimerQueue timers;
  timers.set(1, Instant{10});
  timers.set(1, Instant{50});
  CHECK(timers.running(1));
  CHECK(timers.next_due() == Instant{50});
  timers.cancel(1);
  CHECK_FALSE(timers.running(1));
  CHECK(timers.next_due() == kNever);
}
