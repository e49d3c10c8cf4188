/// An arena: one block of a pool of the memory page, allocated and touched at boot.
#pragma once

#include <memory>
#include <new>
#include <span>
#include <type_traits>

#include "platform/memory/budget.hpp"

namespace firstlook::memory {

/// `count` zeroed elements that are accounted to a pool as long as the buffer lives.
template <typename T>
class PoolBuffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  PoolBuffer() = default;
  /// Error: kOutOfMemory when the pool's row or the machine has no room.
  [[nodiscard]] static Result<PoolBuffer> make(Pool pool, std::size_t count) {
    if (count > kBudgetBytes / sizeof(T)) {
      return failure(Fault::kOutOfMemory, "{}: {} elements of {} bytes", budget_row(pool).name, count, sizeof(T));
    }
    Result<PoolShare> share = PoolShare::take(pool, count * sizeof(T));
    if (!share) return std::unexpected(share.error());
    PoolBuffer buffer;
    // Value-initialised: every page is written, so it is resident before the first use.
    buffer.items_.reset(new (std::nothrow) T[count]());
    if (!buffer.items_) {
      return failure(Fault::kOutOfMemory, "{}: the system gives no {} bytes", budget_row(pool).name, count * sizeof(T));
    }
    buffer.count_ = count;
    buffer.share_ = std::move(*share);
    return buffer;
  }

  [[nodiscard]] std::span<T> items() { return {items_.get(), count_}; }
  [[nodiscard]] std::span<const T> items() const { return {items_.get(), count_}; }
  [[nodiscard]] std::size_t size() const { return count_; }

 private:
  std::unique_ptr<T[]> items_;
  std::size_t count_ = 0;
  PoolShare share_;
};

}  // namespace firstlook::memory
