/// RTDE at 500 Hz for as long as a cart may stand switched on: nothing is lost, nothing drifts, nothing grows.
#include <malloc.h>

#include <catch2/catch.hpp>

#include "hal/ur/rtde_client.hpp"
#include "platform/loop/clock_mapping.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/support/ur_memory_network.hpp"
#include "tests/support/ur_robot.hpp"

namespace firstlook {
namespace {

/// The controller's clock runs fast by this share.
void stream_for(double hours, double clock_off) {
  test::UrRobot ur("ur5e");
  test::UrMemoryNetwork network(ur.robot);
  ur::RtdeClient client(network, 500);
  ClockMapping clock;
  const auto cycles = static_cast<std::int64_t>(hours * 3600 * 500);
  const double cycle_ns = 2e6 / (1 + clock_off);
  constexpr std::int64_t kStarted = 5000;  // by then buffers have the size that they keep
  std::size_t heap_bytes = 0;
  std::uint64_t reports = 0;
  double last_s = 0;
  Instant stamp{};
  std::int64_t late_max_ns = 0;
  bool in_order = true;
  for (std::int64_t i = 1; i <= cycles; ++i) {
    network.advance(Instant{i * 2'000'000});  // on its own clock
    const Instant now{static_cast<std::int64_t>(static_cast<double>(i) * cycle_ns)};
    while (const auto report = client.poll(now)) {
      ++reports;
      in_order = in_order && (reports == 1 || std::abs(report->timestamp_s - last_s - 0.002) < 1e-9);
      last_s = report->timestamp_s;
      const Instant mapped = clock.to_ours(report->timestamp_s, now);
      in_order = in_order && mapped > stamp && mapped <= now;
      stamp = mapped;
      if (i > kStarted) late_max_ns = std::max(late_max_ns, (now - mapped).ns);
    }
    if (i == kStarted) heap_bytes = mallinfo2().uordblks;
  }
  CHECK(in_order);
  CHECK(reports + 20 > static_cast<std::uint64_t>(cycles));  // but for the first, in which it connects
  CHECK(client.counters().connections == 1);
  CHECK(client.counters().broken == 0);
  CHECK(late_max_ns < 1'000'000);  // what a clock that is off gains in the window of the mapping
  if (test::kSlowdown == 1) CHECK(mallinfo2().uordblks < heap_bytes + 4096);
}

}  // namespace

TEST_CASE("ten minutes of RTDE at 500 Hz, the controller's clock 50 ppm off", "[ur]") {
  stream_for(1.0 / 6, GENERATE(5e-5, -5e-5));
}

TEST_CASE("a day of RTDE at 500 Hz", "[.day]") { stream_for(24, 5e-5); }

}  // namespace firstlook
