/// The loop: collect, dispatch, flush, wait. One thread, bounded work for each turn.
#pragma once

#include <cstdint>

#include "platform/core/fixed_vector.hpp"
#include "platform/core/result.hpp"
#include "platform/journal/journal.hpp"
#include "platform/loop/clock.hpp"
#include "platform/loop/event.hpp"
#include "platform/loop/jobs.hpp"
#include "platform/loop/timers.hpp"
#include "platform/loop/watchdog.hpp"

namespace firstlook {

/// A device or anything else that events come from. Loop thread; never blocks or allocates.
class EventSource {
 public:
  virtual ~EventSource() = default;
  /// When there may be something to collect; kNever when that is not known (real time: the clock is woken).
  [[nodiscard]] virtual Instant next_due() const = 0;
  /// Puts what has come into the queue. Leaves the rest for the next turn when the queue has no room; an error is for
  /// what is lost (kQueueFull): the handler gets it as kEventLoopFault.
  [[nodiscard]] virtual Status collect(Instant now, EventQueue& queue) = 0;
};

/// What an event is worth to the journal: see JournalWriter::event and hold.
enum class Worth : std::uint8_t { kRecord, kHold, kHoldAsBasis };

/// The application. Runs to completion, never blocks.
class EventHandler {
 public:
  virtual ~EventHandler() = default;
  /// Asked before on_event.
  [[nodiscard]] virtual Worth worth(const Event&) const { return Worth::kRecord; }
  virtual void on_event(const Event& event) = 0;
  /// All events of this turn are dispatched: send what is to be sent.
  virtual void end_of_turn(Instant now) = 0;
};

/// Turns until stop(). The order within a turn: sources in order of registration and job completions are collected and
/// dispatched, then faults of sources, then timers that are still due. Each event is journalled, then handled.
class EventLoop {
 public:
  static constexpr std::size_t kSourcesMax = 16;

  /// All outlive the loop. journal may be null.
  EventLoop(Clock& clock, JournalWriter* journal, EventHandler& handler, TimerQueue& timers, JobRunner& jobs);

  void add_source(EventSource& source);
  /// Null: none.
  void set_watchdog(Watchdog* watchdog) { watchdog_ = watchdog; }
  /// Limits the turns of run(); 0: no limit.
  void set_turn_limit(std::uint64_t turns) { turn_limit_ = turns; }

  /// Turns until stop() was called. Errors: kInternal when the turn limit is reached, or in virtual time when nothing
  /// is due any more.
  [[nodiscard]] Status run();
  /// One turn without the wait at its end; returns when the next is due.
  Instant turn();
  /// Ends run() after the current turn. From a handler.
  void stop() { stopped_ = true; }
  [[nodiscard]] std::uint64_t turns() const { return turns_; }
  [[nodiscard]] std::uint64_t events() const { return events_; }

 private:
  void collect(Instant now);
  void run_timers(Instant now);
  template <typename T>
  void dispatch_own(Instant now, std::uint16_t kind, T value);
  void dispatch_all();
  void record(const Event& event);
  [[nodiscard]] Instant next_due() const;

  Clock& clock_;
  JournalWriter* journal_;
  EventHandler& handler_;
  TimerQueue& timers_;
  JobRunner& jobs_;
  FixedVector<EventSource*, kSourcesMax> sources_;
  Watchdog* watchdog_ = nullptr;
  EventQueue queue_;
  std::uint64_t turn_limit_ = 0;
  std::uint64_t turns_ = 0;
  std::uint64_t events_ = 0;
  bool stopped_ = false;
};

}  // namespace firstlook
