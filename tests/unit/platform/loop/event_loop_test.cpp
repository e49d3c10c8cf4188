#include "platform/loop/event_loop.hpp"

#include <catch2/catch.hpp>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "platform/core/random.hpp"
#include "platform/journal/archive.hpp"
#include "platform/memory/allocation_guard.hpp"

using namespace firstlook;

namespace {

/// Fires at fixed intervals, `count` times, with its own kind.
class Ticker final : public EventSource {
 public:
  Ticker(std::uint16_t kind, Duration interval, int count) : kind_(kind), interval_(interval), left_(count) {}
  [[nodiscard]] Instant next_due() const override { return left_ > 0 ? next_ : kNever; }
  [[nodiscard]] Status collect(Instant now, EventQueue& queue) override {
    while (left_ > 0 && next_ <= now && !queue.full()) {
      if (Status status = queue.push(now, kind_, std::as_bytes(std::span(&left_, 1))); !status) return status;
      next_ = next_ + interval_;
      --left_;
    }
    return {};
  }

 private:
  std::uint16_t kind_;
  Duration interval_;
  int left_;
  Instant next_{};
};

/// Loses an event once.
class Loser final : public EventSource {
 public:
  [[nodiscard]] Instant next_due() const override { return lost_ ? kNever : Instant{}; }
  [[nodiscard]] Status collect(Instant, EventQueue&) override {
    if (std::exchange(lost_, true)) return {};
    return failure(Fault::kQueueFull, "lost");
  }

 private:
  bool lost_ = false;
};

class Doubler final : public JobExecutor {
 public:
  std::size_t execute(const JobRequest& request, std::span<std::byte> result) noexcept override {
    return pack(request.number * 2, result);
  }
};

/// Everything a loop needs, with a handler made of functions.
struct House final : EventHandler {
  void on_event(const Event& event) override {
    log.push_back(fmt::format("{}:{}", event.time.ns / 1'000'000, event.kind));
    if (handle) handle(event);
  }
  void end_of_turn(Instant now) override {
    if (ended) ended(now);
  }
  void submit(std::uint32_t number, Duration duration) {
    request->kind = 1;
    request->number = number;
    request->virtual_duration = duration;
    REQUIRE(jobs.submit(*request, clock.now()));
  }

  VirtualClock clock;
  Doubler executor;
  JobRunner jobs{executor, clock, JobMode::kVirtual};
  TimerQueue timers;
  std::unique_ptr<JobRequest> request = std::make_unique<JobRequest>();
  std::vector<std::string> log;
  std::function<void(const Event&)> handle;
  std::function<void(Instant)> ended;
};

}  // namespace

TEST_CASE("a turn: sources in order of registration, completions, timers, time jumps to what is due next") {
  House house;
  EventLoop loop(house.clock, nullptr, house, house.timers, house.jobs);
  CountingWatchdog watchdog;
  loop.set_watchdog(&watchdog);
  Ticker slow(17, milliseconds(20), 3);
  Ticker fast(16, milliseconds(10), 5);
  loop.add_source(slow);
  loop.add_source(fast);
  house.timers.set(2, Instant{} + milliseconds(20));
  house.timers.set(1, Instant{} + milliseconds(20));
  house.timers.set(3, Instant{} + milliseconds(35));
  house.submit(7, milliseconds(20));
  house.handle = [&](const Event& event) {
    if (event.kind == kEventTimer) {
      std::uint32_t id = 0;
      REQUIRE(unpack(event.bytes(), id));
      house.log.back() += fmt::format("#{}", id);
    }
    if (event.time >= Instant{} + milliseconds(40)) loop.stop();
  };
  REQUIRE(loop.run());
  const std::vector<std::string> expected = {"0:17",   "0:16",   "10:16", "20:17",  "20:16", "20:2",
                                             "20:1#1", "20:1#2", "30:16", "35:1#3", "40:17", "40:16"};
  CHECK(house.log == expected);
  CHECK(watchdog.turns() == loop.turns());
  CHECK(watchdog.last() == Instant{} + milliseconds(40));
}

TEST_CASE("a timer that a handler of the same turn cancels does not fire, one that is due at once fires") {
  House house;
  EventLoop loop(house.clock, nullptr, house, house.timers, house.jobs);
  Ticker ticker(16, milliseconds(10), 1);
  loop.add_source(ticker);
  house.timers.set(5, Instant{});
  house.handle = [&](const Event& event) {
    if (event.kind == 16) {
      house.timers.cancel(5);
      house.timers.set(6, event.time);
    } else {
      loop.stop();
    }
  };
  REQUIRE(loop.run());
  CHECK(house.log == std::vector<std::string>{"0:16", "0:1"});
}

TEST_CASE("a timer that is always set for now does not keep a turn from ending, and the turn limit ends the loop") {
  House house;
  EventLoop loop(house.clock, nullptr, house, house.timers, house.jobs);
  loop.set_turn_limit(3);
  house.timers.set(0, Instant{});
  house.handle = [&](const Event& event) { house.timers.set(0, event.time); };
  const Status status = loop.run();
  REQUIRE_FALSE(status);
  CHECK(status.error().fault == Fault::kInternal);
  CHECK(loop.turns() == 3);
  CHECK(house.log.size() == 3 * TimerQueue::kTimersMax);
}

TEST_CASE("in virtual time a loop with nothing due says so instead of hanging") {
  House house;
  EventLoop loop(house.clock, nullptr, house, house.timers, house.jobs);
  Ticker ticker(16, milliseconds(10), 2);
  loop.add_source(ticker);
  const Status status = loop.run();
  REQUIRE_FALSE(status);
  CHECK(house.log.size() == 2);
}

TEST_CASE("what a source loses becomes an event with its fault, after the others of the turn") {
  House house;
  EventLoop loop(house.clock, nullptr, house, house.timers, house.jobs);
  Loser loser;
  Ticker ticker(16, milliseconds(10), 1);
  loop.add_source(loser);
  loop.add_source(ticker);
  Fault seen = Fault::kInternal;
  house.handle = [&](const Event& event) {
    if (event.kind != kEventLoopFault) return;
    CHECK(unpack(event.bytes(), seen));
    loop.stop();
  };
  REQUIRE(loop.run());
  CHECK(seen == Fault::kQueueFull);
  CHECK(house.log == std::vector<std::string>{"0:16", "0:3"});
}

TEST_CASE("more events than the queue holds are spread over turns, none is lost") {
  House house;
  EventLoop loop(house.clock, nullptr, house, house.timers, house.jobs);
  Ticker burst(16, milliseconds(0), 150);
  loop.add_source(burst);
  house.ended = [&](Instant) {
    if (house.log.size() == 150) loop.stop();
  };
  REQUIRE(loop.run());
  CHECK(loop.turns() == 3);
  CHECK(house.log.size() == 150);
}

TEST_CASE("in real time a job's completion wakes the loop") {
  struct Starter final : EventHandler {
    void on_event(const Event& event) override {
      if (event.kind == kEventJobDone) {
        std::uint16_t kind = 0;
        ByteReader reader(event.bytes());
        reader(kind, number, result);
        loop->stop();
      }
    }
    void end_of_turn(Instant) override {}
    EventLoop* loop = nullptr;
    std::uint32_t number = 0;
    std::uint32_t result = 0;
  } starter;
  RealClock clock;
  Doubler executor;
  JobRunner jobs(executor, clock, JobMode::kThreaded);
  TimerQueue timers;
  EventLoop loop(clock, nullptr, starter, timers, jobs);
  starter.loop = &loop;
  loop.set_turn_limit(1000);
  const auto request = std::make_unique<JobRequest>();
  request->number = 21;
  REQUIRE(jobs.submit(*request, clock.now()));
  REQUIRE(loop.run());
  CHECK(starter.number == 21);
  CHECK(starter.result == 42);
}

TEST_CASE("two runs journal the same bytes, events and decisions in their order, without allocating") {
  const auto run = [] {
    House house;
    house.log.reserve(1000);
    auto journal = JournalWriter::create_memory({.program_version = "test", .config = "seed: 1"}, 1 << 20);
    REQUIRE(journal);
    EventLoop loop(house.clock, journal->get(), house, house.timers, house.jobs);
    Ticker ticker(16, milliseconds(8), 20);
    loop.add_source(ticker);
    Random random(1, 999);
    house.handle = [&](const Event& event) {
      const std::uint64_t choice = random.bits();
      (*journal)->decision(1, event.time, std::as_bytes(std::span(&choice, 1)));
      if (event.kind == 16) house.timers.set(static_cast<std::uint32_t>(choice % 8), event.time + milliseconds(3));
    };
    house.ended = [&](Instant) {
      if (ticker.next_due() == kNever && house.timers.next_due() == kNever) loop.stop();
    };
    memory::seal();
    const Status status = loop.run();
    const std::uint64_t allocations = memory::loop_allocations_after_seal();
    memory::unseal();
    REQUIRE(status);
    // The texts of the log are short enough for std::string itself; nothing else may allocate.
    CHECK(allocations == 0);
    REQUIRE((*journal)->close(house.clock.now()));
    const auto bytes = (*journal)->memory();
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  };
  const std::vector<std::byte> first = run();
  CHECK(first == run());
  auto reader = JournalReader::from_bytes(first);
  REQUIRE(reader);
  int events = 0;
  int decisions = 0;
  while (true) {
    const auto record = reader->next();
    REQUIRE(record);
    if (!*record) break;
    (*record)->type == RecordType::kEvent ? ++events : ++decisions;
    CHECK(events - decisions == ((*record)->type == RecordType::kEvent ? 1 : 0));
  }
  CHECK(events == 40);
}
