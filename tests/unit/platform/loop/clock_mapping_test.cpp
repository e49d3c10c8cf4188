#include "platform/loop/clock_mapping.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {
Instant at(double t_s) { return Instant{seconds(t_s).ns}; }
}  // namespace

TEST_CASE("another clock is mapped by the least delay, with drift, and never into the future") {
  // Their clock began 100 s before ours and runs 50 ppm fast; delays are 0.3 ms to 6 ms.
  ClockMapping mapping;
  Random random(1, 2);
  Instant last{-1};
  for (int i = 0; i < 20'000; ++i) {
    const double here_s = 1 + 0.008 * i;
    const double there_s = 100 + here_s * (1 + 50e-6);
    const Instant arrived = at(here_s + random.uniform(0.0003, 0.006));
    const Instant mapped = mapping.to_ours(there_s, arrived);
    REQUIRE(mapped <= arrived);
    REQUIRE(mapped > last);
    if (i > 200) REQUIRE(std::abs((mapped - at(here_s)).seconds()) < 0.9e-3);
    last = mapped;
  }
}

TEST_CASE("a clock that leaps is another one") {
  ClockMapping mapping;
  static_cast<void>(mapping.to_ours(500, at(1)));
  CHECK(std::abs((mapping.to_ours(500.008, at(1.008)) - at(1.008)).seconds()) < 1e-6);
  // Switched off and on again: it begins at 0.
  CHECK(std::abs((mapping.to_ours(0.5, at(60)) - at(60)).seconds()) < 1e-6);
  // Ours set anew: a stamp from before that does not hold the new ones back.
  CHECK(std::abs((mapping.to_ours(0.6, at(0.1)) - at(0.1)).seconds()) < 1e-6);
}

}  // namespace firstlook
