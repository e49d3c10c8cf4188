/// Events: what happened, when, as bytes; and the bounded queue between the sources and the handler.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>

#include "platform/core/result.hpp"
#include "platform/core/time.hpp"
#include "platform/memory/budget.hpp"

namespace firstlook {

/// Due time of something that is not expected.
inline constexpr Instant kNever{std::numeric_limits<std::int64_t>::max()};

inline constexpr std::size_t kEventBytesMax = 16384;  ///< the largest job result with its head
inline constexpr std::size_t kEventQueueCapacity = 64;

// Kinds below 16 belong to the loop, the others to the application.
inline constexpr std::uint16_t kEventTimer = 1;      ///< payload: u32 id
inline constexpr std::uint16_t kEventJobDone = 2;    ///< payload: u16 kind, u32 number, the result's bytes
inline constexpr std::uint16_t kEventLoopFault = 3;  ///< payload: u16 Fault; the loop goes on
inline constexpr std::uint16_t kEventKindApplication = 16;

/// Trivially copyable; only the first `size` bytes of the payload mean anything. Too large for the stack of a handler.
struct Event {
  Instant time{};
  std::uint16_t kind = 0;
  std::uint32_t size = 0;
  std::array<std::byte, kEventBytesMax> payload;

  [[nodiscard]] std::span<const std::byte> bytes() const { return {payload.data(), size}; }
};
static_assert(std::is_trivially_copyable_v<Event>);

/// First in, first out; 64 slots allocated at construction, accounted to Pool::kEventQueue, which has room for one
/// queue at a time (ENSURE 1401); one thread.
class EventQueue {
 public:
  EventQueue();
  /// Copies an event in. Errors: kQueueFull when there is no slot.
  [[nodiscard]] Status push(Instant time, std::uint16_t kind, std::span<const std::byte> payload);
  /// The same with the payload in two parts, one after the other.
  [[nodiscard]] Status push(Instant time, std::uint16_t kind, std::span<const std::byte> head,
                            std::span<const std::byte> body);
  [[nodiscard]] const Event& front() const;
  void pop();
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] bool full() const { return size_ == kEventQueueCapacity; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t free_slots() const { return kEventQueueCapacity - size_; }

 private:
  memory::PoolShare share_;
  std::unique_ptr<std::array<Event, kEventQueueCapacity>> slots_;
  std::size_t head_ = 0;
  std::size_t size_ = 0;
};

}  // namespace firstlook
