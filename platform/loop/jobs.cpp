#include "platform/loop/jobs.hpp"

#include <algorithm>

#include "platform/core/ensure.hpp"
#include "platform/journal/archive.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook {
namespace {

/// Without the part of the arguments that means nothing.
void copy_request(const JobRequest& from, JobRequest& to) {
  to.kind = from.kind;
  to.number = from.number;
  to.on_map_strand = from.on_map_strand;
  to.virtual_duration = from.virtual_duration;
  to.size = from.size;
  std::ranges::copy(from.bytes(), to.arguments.begin());
}

}  // namespace

JobRunner::JobRunner(JobExecutor& executor, Clock& clock, JobMode mode, std::size_t heap_cap_bytes)
    : executor_(executor),
      clock_(clock),
      mode_(mode),
      heap_cap_bytes_(heap_cap_bytes),
      slots_(std::make_unique<Slots>()) {
  Result<memory::PoolShare> share = memory::PoolShare::take(memory::Pool::kJobBuffers, sizeof *slots_);
  ENSURE(1411, share.has_value());
  share_ = std::move(*share);
  if (mode_ == JobMode::kThreaded) {
    strand_.emplace("map strand", [this] { serve(true); });
    worker_.emplace("job worker", [this] { serve(false); });
  }
}

JobRunner::~JobRunner() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  submitted_.notify_all();
}

Status JobRunner::submit(const JobRequest& request, Instant now) {
  ENSURE(1412, request.size <= kJobArgumentBytesMax);
  Slot* slot = nullptr;
  {
    const std::scoped_lock lock(mutex_);
    const auto free_slot = std::ranges::find(*slots_, SlotState::kFree, &Slot::state);
    if (free_slot == slots_->end()) {
      return failure(Fault::kQueueFull, "{} jobs are outstanding, one of kind {} is refused", kJobsMax, request.kind);
    }
    slot = &*free_slot;
    copy_request(request, slot->request);
    slot->due = now + request.virtual_duration;
    slot->order = submissions_++;
    slot->state = mode_ == JobMode::kVirtual ? SlotState::kRunning : SlotState::kWaiting;
    ++counters_.submitted;
  }
  if (mode_ == JobMode::kThreaded) {
    submitted_.notify_all();
  } else {
    execute(*slot);
    slot->state = SlotState::kDone;
  }
  return {};
}

void JobRunner::execute(Slot& slot) {
  const memory::JobHeapScope heap(heap_cap_bytes_);
  slot.result_bytes = executor_.execute(slot.request, slot.result);
  ENSURE(1413, slot.result_bytes <= slot.result.size());
  const std::scoped_lock lock(mutex_);
  counters_.refused_allocations += heap.refused();
  counters_.heap_peak_bytes = std::max(counters_.heap_peak_bytes, heap.peak_bytes());
}

void JobRunner::serve(bool map_strand) {
  compute_in_the_background();
  std::unique_lock lock(mutex_);
  while (true) {
    Slot* slot = nullptr;
    submitted_.wait(lock, [&] { return ending_ || (slot = next_waiting(map_strand)) != nullptr; });
    if (ending_) return;
    slot->state = SlotState::kRunning;
    lock.unlock();
    execute(*slot);
    lock.lock();
    slot->order = completions_++;
    slot->state = SlotState::kDone;
    clock_.wake();
  }
}

JobRunner::Slot* JobRunner::next_waiting(bool map_strand) {
  Slot* first = nullptr;
  for (Slot& slot : *slots_) {
    if (slot.state != SlotState::kWaiting || slot.request.on_map_strand != map_strand) continue;
    if (first == nullptr || slot.order < first->order) first = &slot;
  }
  return first;
}

JobRunner::Slot* JobRunner::next_done(Instant now) {
  const auto earlier = [this](const Slot& a, const Slot& b) {
    if (mode_ == JobMode::kThreaded) return a.order < b.order;
    if (a.due != b.due) return a.due < b.due;
    return a.request.number < b.request.number;
  };
  Slot* first = nullptr;
  for (Slot& slot : *slots_) {
    if (slot.state != SlotState::kDone || (mode_ == JobMode::kVirtual && slot.due > now)) continue;
    if (first == nullptr || earlier(slot, *first)) first = &slot;
  }
  return first;
}

Instant JobRunner::next_due() const {
  const std::scoped_lock lock(mutex_);
  Instant first = kNever;
  for (const Slot& slot : *slots_) {
    if (slot.state == SlotState::kDone) first = std::min(first, mode_ == JobMode::kVirtual ? slot.due : Instant{});
  }
  return first;
}

void JobRunner::collect(Instant now, EventQueue& queue) {
  const std::scoped_lock lock(mutex_);
  while (!queue.full()) {
    Slot* const slot = next_done(now);
    if (slot == nullptr) return;
    std::array<std::byte, kJobHeadBytes> head;
    ByteWriter writer(head);
    writer(slot->request.kind, slot->request.number);
    const Status pushed =
        queue.push(now, kEventJobDone, head, std::span<const std::byte>(slot->result).first(slot->result_bytes));
    ENSURE(1414, pushed.has_value());
    slot->state = SlotState::kFree;
    ++counters_.completed;
  }
}

std::size_t JobRunner::outstanding() const {
  const std::scoped_lock lock(mutex_);
  return kJobsMax - static_cast<std::size_t>(std::ranges::count(*slots_, SlotState::kFree, &Slot::state));
}

JobCounters JobRunner::counters() const {
  const std::scoped_lock lock(mutex_);
  return counters_;
}

}  // namespace firstlook
