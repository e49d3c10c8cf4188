#include "hal/v4l2/threaded_camera.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace firstlook::v4l2 {
namespace {
constexpr Duration kLook = milliseconds(8);         // of the loop, for what the thread left: a turn of the arm
constexpr Duration kLongestNap = milliseconds(50);  // of the thread
constexpr Duration kNap = milliseconds(2);          // where the driver did not let us wait for a frame
}  // namespace

Result<std::unique_ptr<ThreadedCamera>> ThreadedCamera::make(SystemCalls& system, const V4l2CameraOptions& options) {
  Result<std::unique_ptr<V4l2Camera>> camera = V4l2Camera::make(system, options);
  if (!camera) return std::unexpected(camera.error());
  std::unique_ptr<ThreadedCamera> threaded(new ThreadedCamera(system, std::move(*camera)));
  threaded->report_ = threaded->camera_->report({});
  threaded->color_ = threaded->camera_->delivers_color();
  threaded->thread_.emplace("v4l2", [t = threaded.get()] { t->work(); });
  return threaded;
}

ThreadedCamera::~ThreadedCamera() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.reset();
}

void ThreadedCamera::work() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return stop_ || origin_ns_; });
  while (!stop_) {
    const std::int64_t origin_ns = *origin_ns_;
    lock.unlock();
    const Instant now{system_.monotonic_ns() - origin_ns};
    const auto frame = camera_->poll(now);
    const hal::StreamCounters stream = camera_->counters();
    const hal::DeviceReport report = camera_->report(now);
    Duration nap = std::clamp(camera_->next_due() - now, kNap, kLongestNap);
    lock.lock();
    if (frame) newest_ = frame;
    stream_ = stream;
    report_ = report;
    color_ = camera_->delivers_color();
    if (camera_->is_open()) {
      lock.unlock();
      const bool comes = camera_->wait(static_cast<int>(kLongestNap.ns / 1'000'000));
      lock.lock();
      if (comes) continue;
      nap = kNap;
    }
    changed_.wait_for(lock, std::chrono::nanoseconds(nap.ns), [&] { return stop_; });
  }
}

std::optional<hal::Frame> ThreadedCamera::poll(Instant now) {
  due_ = now + kLook;
  const std::int64_t origin_ns = system_.monotonic_ns() - now.ns;
  const std::scoped_lock lock(mutex_);
  if (!origin_ns_) changed_.notify_all();
  origin_ns_ = origin_ns_ ? std::min(*origin_ns_, origin_ns) : origin_ns;
  if (!newest_ || newest_->stamp > now) return {};
  return std::exchange(newest_, std::nullopt);
}

hal::StreamCounters ThreadedCamera::counters() const {
  const std::scoped_lock lock(mutex_);
  return stream_;
}

bool ThreadedCamera::delivers_color() const {
  const std::scoped_lock lock(mutex_);
  return color_;
}

hal::DeviceReport ThreadedCamera::report(Instant) const {
  const std::scoped_lock lock(mutex_);
  return report_;
}

}  // namespace firstlook::v4l2
