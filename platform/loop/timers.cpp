#include "platform/loop/timers.hpp"

#include <algorithm>

#include "platform/core/ensure.hpp"

namespace firstlook {

void TimerQueue::set(std::uint32_t id, Instant due) {
  ENSURE(1405, id < kTimersMax);
  due_[id] = due;
}

void TimerQueue::cancel(std::uint32_t id) { set(id, kNever); }

bool TimerQueue::running(std::uint32_t id) const {
  ENSURE(1406, id < kTimersMax);
  return due_[id] != kNever;
}

Instant TimerQueue::next_due() const { return *std::ranges::min_element(due_); }

std::optional<std::uint32_t> TimerQueue::pop_due(Instant now) {
  const auto first = std::ranges::min_element(due_);  // the first of equal ones: the lowest number
  if (*first == kNever || *first > now) return std::nullopt;
  *first = kNever;
  return static_cast<std::uint32_t>(first - due_.begin());
}

}  // namespace firstlook
