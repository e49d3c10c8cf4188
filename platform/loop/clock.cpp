#include "platform/loop/clock.hpp"

#include <algorithm>

namespace firstlook {
namespace {
// The loop turns at least this often, so that the watchdog is fed and signals are seen while nothing happens.
constexpr Duration kLongestSleep = milliseconds(200);
}  // namespace

void RealClock::sleep_until(Instant until) {
  const Instant latest = now() + kLongestSleep;
  wakeup_.wait_until(start_ns_ + std::min(until, latest).ns);
}

}  // namespace firstlook
