/// The last frames of a camera, copied by its driver and read by jobs.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <mutex>
#include <span>

#include "hal/api/cameras.hpp"
#include "platform/memory/pool_buffer.hpp"

namespace firstlook::hal {

/// Slots of one size, for drivers: as many as the pool's row holds. store() from one thread, which never waits: a slot
/// that a job reads just then is not overwritten. with() from any thread.
class FrameSlots {
 public:
  static constexpr std::uint32_t kSlotsMax = 32;
  static constexpr std::uint32_t kSlotsMin = 6;  ///< 0.2 s at 30 Hz: a job that was just begun still finds its frame

  /// Error: kOutOfMemory when fewer than kSlotsMin fit.
  [[nodiscard]] Status make(memory::Pool pool, std::size_t bytes_each) {
    const std::size_t row = memory::budget_row(pool).bytes();
    if (bytes_each == 0 || row / kSlotsMin < bytes_each) {
      return failure(Fault::kOutOfMemory, "{}: frames of {} bytes; the largest that fit have {}",
                     memory::budget_row(pool).name, bytes_each, row / kSlotsMin);
    }
    const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(kSlotsMax, row / bytes_each));
    auto buffer = memory::PoolBuffer<std::uint8_t>::make(pool, count * bytes_each);
    if (!buffer) return std::unexpected(buffer.error());
    bytes_ = std::move(*buffer);
    bytes_each_ = bytes_each;
    count_ = count;
    return {};
  }
  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] std::size_t bytes_each() const { return bytes_each_; }

  /// Has `copy` write `size` bytes into the oldest slot. False when they do not fit, or a job is still reading that
  /// frame; then nothing is kept.
  template <typename Copy>
  [[nodiscard]] bool store(std::size_t size, Frame& frame, Copy copy) {
    if (count_ == 0 || size > bytes_each_) return false;
    const std::uint32_t n = next_ % count_;
    Slot& slot = slots_[n];
    const std::unique_lock lock(slot.mutex, std::try_to_lock);
    if (!lock.owns_lock()) return false;
    copy(bytes_.items().subspan(n * bytes_each_, size));
    frame.slot = n;
    slot.sequence = frame.sequence;
    slot.size = size;
    slot.used = true;
    ++next_;
    return true;
  }

  /// Calls `read` with the bytes of a frame. Error: kFrameGone; what `read` returns.
  template <typename Read>
  [[nodiscard]] Status with(const Frame& frame, Read read) const {
    if (frame.slot >= count_) return failure(Fault::kFrameGone, "frame {}", frame.sequence);
    const Slot& slot = slots_[frame.slot];
    const std::scoped_lock lock(slot.mutex);
    if (!slot.used || slot.sequence != frame.sequence) return failure(Fault::kFrameGone, "frame {}", frame.sequence);
    return read(bytes_.items().subspan(frame.slot * bytes_each_, slot.size));
  }

 private:
  struct Slot {
    mutable std::mutex mutex;
    std::uint32_t sequence = 0;
    std::size_t size = 0;
    bool used = false;
  };
  std::array<Slot, kSlotsMax> slots_;
  memory::PoolBuffer<std::uint8_t> bytes_;
  std::size_t bytes_each_ = 0;
  std::uint32_t count_ = 0;
  std::uint32_t next_ = 0;
};

}  // namespace firstlook::hal
