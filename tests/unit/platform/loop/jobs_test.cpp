#include "platform/loop/jobs.hpp"

#include <sched.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <memory>
#include <new>
#include <vector>

#include "platform/journal/archive.hpp"
#include "platform/memory/allocation_guard.hpp"

using namespace firstlook;

namespace {

/// Echoes the number twice; kind 2 allocates more than its allowance and says what came of it.
class Echo final : public JobExecutor {
 public:
  std::size_t execute(const JobRequest& request, std::span<std::byte> result) noexcept override {
    std::uint8_t failed = 0;
    if (request.kind == 2) {
      try {
        const std::vector<char> big(std::size_t{64} << 20);
        asm volatile("" : : "g"(big.data()) : "memory");  // the compiler may not remove the allocation
      } catch (const std::bad_alloc&) {
        failed = 1;
      }
    }
    while (request.kind == 3 && !released.load()) {
    }
    const std::size_t at = begun.fetch_add(1);
    if (at < order.size()) order[at] = request.number;
    ByteWriter writer(result);
    writer(request.number * 2, failed);
    return writer.size();
  }
  std::array<std::uint32_t, 32> order{};
  std::atomic<std::size_t> begun{0};
  std::atomic<bool> released{false};
};

std::unique_ptr<JobRequest> request(std::uint16_t kind, std::uint32_t number, bool strand, Duration duration = {}) {
  auto made = std::make_unique<JobRequest>();
  made->kind = kind;
  made->number = number;
  made->on_map_strand = strand;
  made->virtual_duration = duration;
  return made;
}

struct Completion {
  std::uint16_t kind = 0;
  std::uint32_t number = 0;
  std::uint32_t doubled = 0;
  std::uint8_t failed = 0;
};

std::vector<Completion> drain(EventQueue& queue) {
  std::vector<Completion> completions;
  while (!queue.empty()) {
    CHECK(queue.front().kind == kEventJobDone);
    Completion c;
    ByteReader reader(queue.front().bytes());
    reader(c.kind, c.number, c.doubled, c.failed);
    CHECK(reader.ok());
    CHECK(reader.remaining() == 0);
    completions.push_back(c);
    queue.pop();
  }
  return completions;
}

}  // namespace

TEST_CASE("in virtual time a job completes after its declared duration, ties in order of number") {
  Echo echo;
  VirtualClock clock;
  JobRunner jobs(echo, clock, JobMode::kVirtual);
  EventQueue queue;
  CHECK(jobs.next_due() == kNever);
  REQUIRE(jobs.submit(*request(1, 5, false, milliseconds(30)), Instant{}));
  REQUIRE(jobs.submit(*request(1, 4, true, milliseconds(30)), Instant{}));
  REQUIRE(jobs.submit(*request(1, 9, true, milliseconds(10)), Instant{}));
  CHECK(jobs.outstanding() == 3);
  CHECK(jobs.next_due() == Instant{} + milliseconds(10));
  jobs.collect(Instant{} + milliseconds(9), queue);
  CHECK(queue.empty());
  jobs.collect(Instant{} + milliseconds(10), queue);
  const auto first = drain(queue);
  REQUIRE(first.size() == 1);
  CHECK(first[0].number == 9);
  CHECK(first[0].doubled == 18);
  jobs.collect(Instant{} + milliseconds(30), queue);
  const auto rest = drain(queue);
  REQUIRE(rest.size() == 2);
  CHECK(rest[0].number == 4);
  CHECK(rest[1].number == 5);
  CHECK(jobs.outstanding() == 0);
  CHECK(jobs.counters().completed == 3);
}

TEST_CASE("at most kJobsMax jobs are outstanding") {
  Echo echo;
  VirtualClock clock;
  JobRunner jobs(echo, clock, JobMode::kVirtual);
  EventQueue queue;
  for (std::uint32_t i = 0; i < kJobsMax; ++i) REQUIRE(jobs.submit(*request(1, i, false), Instant{}));
  const Status refused = jobs.submit(*request(1, 99, false), Instant{});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().fault == Fault::kQueueFull);
  jobs.collect(Instant{}, queue);
  CHECK(queue.size() == kJobsMax);
  CHECK(jobs.submit(*request(1, 99, false), Instant{}));
}

TEST_CASE("a full event queue leaves completions for the next turn") {
  Echo echo;
  VirtualClock clock;
  JobRunner jobs(echo, clock, JobMode::kVirtual);
  EventQueue queue;
  for (std::uint32_t i = 0; i < 3; ++i) REQUIRE(jobs.submit(*request(1, i, false), Instant{}));
  while (queue.free_slots() > 1) REQUIRE(queue.push(Instant{}, 16, {}));
  jobs.collect(Instant{}, queue);
  CHECK(queue.full());
  CHECK(jobs.outstanding() == 2);
}

TEST_CASE("a job that wants more than its allowance fails alone, and submit and collect do not allocate") {
  Echo echo;
  VirtualClock clock;
  JobRunner jobs(echo, clock, JobMode::kVirtual, 1 << 20);
  EventQueue queue;
  const auto greedy = request(2, 1, false);
  memory::seal();
  const Status submitted = jobs.submit(*greedy, Instant{});
  jobs.collect(Instant{}, queue);
  const std::uint64_t allocations = memory::loop_allocations_after_seal();
  memory::unseal();
  REQUIRE(submitted);
  CHECK(allocations == 0);
  const auto completions = drain(queue);
  REQUIRE(completions.size() == 1);
  CHECK(completions[0].failed == 1);
  CHECK(jobs.counters().refused_allocations == 1);
}

TEST_CASE("threaded: the strand keeps the order of submission, other jobs pass it, completions wake the clock") {
  Echo echo;
  RealClock clock;
  JobRunner jobs(echo, clock, JobMode::kThreaded);
  EventQueue queue;
  const auto wait_for = [&](std::size_t count) {
    while (queue.size() < count) {
      clock.sleep_until(jobs.next_due());
      jobs.collect(clock.now(), queue);
    }
  };
  // The strand's first job waits until it is released; the free worker's job is done before it.
  REQUIRE(jobs.submit(*request(3, 1, true), clock.now()));
  for (std::uint32_t i = 2; i <= 6; ++i) REQUIRE(jobs.submit(*request(1, i, true), clock.now()));
  REQUIRE(jobs.submit(*request(1, 100, false), clock.now()));
  wait_for(1);
  const auto free_one = drain(queue);
  CHECK(free_one[0].number == 100);
  CHECK(jobs.outstanding() == 6);
  echo.released = true;
  wait_for(6);
  const auto strand = drain(queue);
  for (std::uint32_t i = 0; i < 6; ++i) {
    CHECK(strand[i].number == i + 1);
    CHECK(echo.order[i + 1] == i + 1);
  }
}

TEST_CASE("threaded: jobs take turns with everything else, whatever priority the loop has") {
  class Policy final : public JobExecutor {
   public:
    std::size_t execute(const JobRequest&, std::span<std::byte>) noexcept override {
      policy = sched_getscheduler(0);  // of the calling thread
      return 0;
    }
    std::atomic<int> policy{-1};
  };
  const sched_param urgent{.sched_priority = 1};
  if (pthread_setschedparam(pthread_self(), SCHED_RR, &urgent) != 0) {
    WARN("skipped: this process may not have a real-time priority");
    return;
  }
  Policy seen;
  RealClock clock;
  {
    JobRunner jobs(seen, clock, JobMode::kThreaded);
    EventQueue queue;
    REQUIRE(jobs.submit(*request(1, 1, true), clock.now()));
    while (queue.empty()) {
      clock.sleep_until(jobs.next_due());
      jobs.collect(clock.now(), queue);
    }
  }
  const sched_param none{};
  CHECK(pthread_setschedparam(pthread_self(), SCHED_OTHER, &none) == 0);
  CHECK(seen.policy == SCHED_OTHER);
}

TEST_CASE("threaded: the runner ends with jobs waiting and one running") {
  Echo echo;
  RealClock clock;
  {
    JobRunner jobs(echo, clock, JobMode::kThreaded);
    for (std::uint32_t i = 1; i <= 8; ++i) REQUIRE(jobs.submit(*request(1, i, i % 2 == 0), clock.now()));
  }
  CHECK(echo.begun <= 8);
}
