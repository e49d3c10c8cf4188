#include "platform/linux/wakeup.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {
constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
}

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNanosecondsPerSecond + now.tv_nsec;
}

Wakeup::Wakeup() : event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) { ENSURE(1601, event_ >= 0); }

Wakeup::~Wakeup() { close(event_); }

void Wakeup::wait_until(std::int64_t monotonic_ns_until) {
  const std::int64_t left_ns = std::max<std::int64_t>(0, monotonic_ns_until - monotonic_ns());
  const timespec left{left_ns / kNanosecondsPerSecond, left_ns % kNanosecondsPerSecond};
  pollfd woken{event_, POLLIN, 0};
  if (ppoll(&woken, 1, &left, nullptr) <= 0) return;
  std::uint64_t times = 0;
  (void)!read(event_, &times, sizeof times);
}

void Wakeup::wake() noexcept {
  const std::uint64_t one = 1;
  (void)!write(event_, &one, sizeof one);
}

}  // namespace firstlook
