/// Containers with a capacity known at compile time: no allocation, ever.
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

#include "platform/core/ensure.hpp"

namespace firstlook {

/// A vector with room for N elements of a trivially copyable type. Pushing beyond N is a programmer error.
template <typename T, std::size_t N>
class FixedVector {
  static_assert(std::is_default_constructible_v<T>);

 public:
  [[nodiscard]] static constexpr std::size_t capacity() { return N; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] bool full() const { return size_ == N; }
  void clear() { size_ = 0; }
  void resize(std::size_t n) {
    ENSURE(1101, n <= N);
    for (std::size_t i = size_; i < n; ++i) items_[i] = T{};
    size_ = n;
  }
  void push_back(const T& item) {
    ENSURE(1102, size_ < N);
    items_[size_++] = item;
  }
  void pop_back() {
    ENSURE(1103, size_ > 0);
    --size_;
  }
  [[nodiscard]] T& operator[](std::size_t i) {
    ENSURE(1104, i < size_);
    return items_[i];
  }
  [[nodiscard]] const T& operator[](std::size_t i) const {
    ENSURE(1105, i < size_);
    return items_[i];
  }
  [[nodiscard]] T& back() { return (*this)[size_ - 1]; }
  [[nodiscard]] const T& back() const { return (*this)[size_ - 1]; }
  [[nodiscard]] T& front() { return (*this)[0]; }
  [[nodiscard]] const T& front() const { return (*this)[0]; }
  [[nodiscard]] T* data() { return items_.data(); }
  [[nodiscard]] const T* data() const { return items_.data(); }
  [[nodiscard]] T* begin() { return items_.data(); }
  [[nodiscard]] T* end() { return items_.data() + size_; }
  [[nodiscard]] const T* begin() const { return items_.data(); }
  [[nodiscard]] const T* end() const { return items_.data() + size_; }

 private:
  std::array<T, N> items_{};
  std::size_t size_ = 0;
};

/// A first-in first-out queue with room for N elements. The caller looks at full() first.
template <typename T, std::size_t N>
class FixedQueue {
 public:
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] bool full() const { return size_ == N; }
  void push(const T& item) {
    ENSURE(1111, size_ < N);
    items_[(head_ + size_++) % N] = item;
  }
  [[nodiscard]] T pop() {
    ENSURE(1112, size_ > 0);
    const std::size_t at = head_;
    head_ = (head_ + 1) % N;
    --size_;
    return items_[at];
  }

 private:
  std::array<T, N> items_{};
  std::size_t head_ = 0;
  std::size_t size_ = 0;
};

}  // namespace firstlook
