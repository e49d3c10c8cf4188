#include "platform/linux/wakeup.hpp"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/timerfd.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>

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

Wakeup::Wakeup()
    : epoll_(epoll_create1(EPOLL_CLOEXEC)),
      timer_(timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)),
      event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  ENSURE(1601, epoll_ >= 0 && timer_ >= 0 && event_ >= 0);
  for (const int descriptor : {timer_, event_}) {
    epoll_event interest{};
    interest.events = EPOLLIN;
    interest.data.fd = descriptor;
    ENSURE(1602, epoll_ctl(epoll_, EPOLL_CTL_ADD, descriptor, &interest) == 0);
  }
}

Wakeup::~Wakeup() {
  for (const int descriptor : {epoll_, timer_, event_}) close(descriptor);
}

void Wakeup::wait_until(std::int64_t monotonic_ns_until) {
  // A timer of zero would be switched off instead of firing at once.
  const std::int64_t until = std::max<std::int64_t>(monotonic_ns_until, 1);
  itimerspec due{};
  due.it_value.tv_sec = until / kNanosecondsPerSecond;
  due.it_value.tv_nsec = until % kNanosecondsPerSecond;
  timerfd_settime(timer_, TFD_TIMER_ABSTIME, &due, nullptr);
  std::array<epoll_event, 2> events{};
  const int count = epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), -1);
  for (int i = 0; i < count; ++i) {
    std::uint64_t expirations = 0;
    (void)!read(events[static_cast<std::size_t>(i)].data.fd, &expirations, sizeof expirations);
  }
}

void Wakeup::wake() noexcept {
  const std::uint64_t one = 1;
  (void)!write(event_, &one, sizeof one);
}

}  // namespace firstlook
