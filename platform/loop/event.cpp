#include "platform/loop/event.hpp"

#include <algorithm>

#include "platform/core/ensure.hpp"

namespace firstlook {

EventQueue::EventQueue() : slots_(std::make_unique<std::array<Event, kEventQueueCapacity>>()) {
  Result<memory::PoolShare> share = memory::PoolShare::take(memory::Pool::kEventQueue, sizeof *slots_);
  ENSURE(1401, share.has_value());
  share_ = std::move(*share);
}

Status EventQueue::push(Instant time, std::uint16_t kind, std::span<const std::byte> payload) {
  return push(time, kind, payload, {});
}

Status EventQueue::push(Instant time, std::uint16_t kind, std::span<const std::byte> head,
                        std::span<const std::byte> body) {
  ENSURE(1402, head.size() + body.size() <= kEventBytesMax);
  if (full()) return failure(Fault::kQueueFull, "{} events wait, one of kind {} is lost", size_, kind);
  Event& slot = (*slots_)[(head_ + size_) % kEventQueueCapacity];
  slot.time = time;
  slot.kind = kind;
  slot.size = static_cast<std::uint32_t>(head.size() + body.size());
  std::ranges::copy(head, slot.payload.begin());
  std::ranges::copy(body, slot.payload.begin() + static_cast<std::ptrdiff_t>(head.size()));
  ++size_;
  return {};
}

const Event& EventQueue::front() const {
  ENSURE(1403, size_ > 0);
  return (*slots_)[head_];
}

void EventQueue::pop() {
  ENSURE(1404, size_ > 0);
  head_ = (head_ + 1) % kEventQueueCapacity;
  --size_;
}

}  // namespace firstlook
