#include "hal/sim/frame_clock.hpp"

#include <algorithm>

#include "platform/memory/allocation_guard.hpp"

namespace firstlook::sim {
namespace {
constexpr Duration kRetry = milliseconds(2);
}

bool FrameClock::dropped(std::uint32_t sequence) const {
  if (timing_.drop_share <= 0) return false;
  const std::uint64_t bits = mix64(mix64(timing_.seed + timing_.drop_stream) + sequence);
  return static_cast<double>(bits >> 11) * 0x1p-53 < timing_.drop_share;
}

hal::Frame FrameClock::keep(std::uint32_t sequence) {
  if (exposed(sequence).seconds() < timing_.freeze_s || !shown_.used) {
    shown_ = {sequence, sequence, exposed(sequence), arm_.true_joints(exposed(sequence)), true};
  }
  ExposedFrame frame = shown_;
  frame.sequence = sequence;
  const std::uint32_t slot = sequence % kSlots;
  const std::scoped_lock lock(mutex_);
  slots_[slot] = frame;
  return {exposed(sequence) + seconds(timing_.clock_offset_s), sequence, slot};
}

std::optional<hal::Frame> FrameClock::poll(Instant now) {
  const memory::SimulationScope simulation;
  arm_.advance(now);
  std::optional<std::uint32_t> newest;
  for (; exposed(next_) + timing_.transfer <= now && !stalled(next_); ++next_) {
    if (exposed(next_) > arm_.known_until()) {
      retry_ = now + kRetry;
      break;
    }
    ++counters_.frames;
    if (dropped(next_)) {
      ++counters_.lost;
    } else {
      newest = next_;
    }
  }
  if (!newest) return std::nullopt;
  return keep(*newest);
}

Instant FrameClock::next_due() const {
  return stalled(next_) ? kNeverDue : std::max(retry_, exposed(next_) + timing_.transfer);
}

Result<ExposedFrame> FrameClock::find(const hal::Frame& frame) const {
  const std::scoped_lock lock(mutex_);
  if (frame.slot >= kSlots || !slots_[frame.slot].used || slots_[frame.slot].sequence != frame.sequence) {
    return failure(Fault::kFrameGone, "frame {}", frame.sequence);
  }
  return slots_[frame.slot];
}

}  // namespace firstlook::sim
