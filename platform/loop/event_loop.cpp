#include "platform/loop/event_loop.hpp"

#include <algorithm>
#include <array>

#include "platform/core/ensure.hpp"
#include "platform/journal/archive.hpp"

namespace firstlook {

EventLoop::EventLoop(Clock& clock, JournalWriter* journal, EventHandler& handler, TimerQueue& timers, JobRunner& jobs)
    : clock_(clock), journal_(journal), handler_(handler), timers_(timers), jobs_(jobs) {}

void EventLoop::add_source(EventSource& source) {
  ENSURE(1431, !sources_.full());
  sources_.push_back(&source);
}

Status EventLoop::run() {
  const std::uint64_t first_turn = turns_;
  stopped_ = false;
  while (true) {
    const Instant due = turn();
    if (stopped_) return {};
    if (turn_limit_ != 0 && turns_ - first_turn >= turn_limit_) {
      return failure(Fault::kInternal, "the loop reached its limit of {} turns at {:.3f} s", turn_limit_,
                     clock_.now().seconds());
    }
    if (due == kNever && clock_.is_virtual()) {
      return failure(Fault::kInternal, "nothing is due after {:.3f} s: the loop would wait for ever",
                     clock_.now().seconds());
    }
    clock_.sleep_until(due);
  }
}

Instant EventLoop::turn() {
  const Instant now = clock_.now();
  ++turns_;
  collect(now);
  run_timers(now);
  handler_.end_of_turn(now);
  if (watchdog_ != nullptr) watchdog_->feed(now);
  return next_due();
}

void EventLoop::collect(Instant now) {
  FixedVector<Fault, kSourcesMax> faults;
  for (EventSource* const source : sources_) {
    if (const Status status = source->collect(now, queue_); !status) faults.push_back(status.error().fault);
  }
  jobs_.collect(now, queue_);
  dispatch_all();
  for (const Fault fault : faults) dispatch_own(now, kEventLoopFault, fault);
}

// One after the other, each after the handlers of those before it, so that a timer that one of them cancels does not
// fire. At most as many as there are timers: one that is set again for now waits for the next turn.
void EventLoop::run_timers(Instant now) {
  for (std::uint32_t fired = 0; fired < TimerQueue::kTimersMax; ++fired) {
    const std::optional<std::uint32_t> id = timers_.pop_due(now);
    if (!id) return;
    dispatch_own(now, kEventTimer, *id);
  }
}

template <typename T>
void EventLoop::dispatch_own(Instant now, std::uint16_t kind, T value) {
  std::array<std::byte, sizeof(T)> payload;
  const std::size_t size = pack(value, payload);
  const Status pushed = queue_.push(now, kind, std::span<const std::byte>(payload).first(size));
  ENSURE(1432, pushed.has_value());
  dispatch_all();
}

void EventLoop::dispatch_all() {
  while (!queue_.empty()) {
    const Event& event = queue_.front();
    if (journal_ != nullptr) record(event);
    ++events_;
    handler_.on_event(event);
    queue_.pop();
  }
}

void EventLoop::record(const Event& event) {
  const Worth worth = handler_.worth(event);
  if (worth == Worth::kRecord) {
    journal_->event(event.kind, event.time, event.bytes());
  } else {
    journal_->hold(event.kind, event.time, event.bytes(), worth == Worth::kHoldAsBasis);
  }
}

Instant EventLoop::next_due() const {
  Instant due = std::min(timers_.next_due(), jobs_.next_due());
  for (const EventSource* const source : sources_) due = std::min(due, source->next_due());
  return due;
}

}  // namespace firstlook
