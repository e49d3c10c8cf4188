/// A V4L2 camera on a thread of its own: opening it may take a second, and the loop must not wait.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>

#include "hal/v4l2/v4l2_camera.hpp"
#include "platform/linux/thread.hpp"

namespace firstlook::v4l2 {

/// For the loop in real time. The thread polls the camera at its pace; poll() gives the newest frame since the last
/// call, however late it comes. read and read_color from any thread, the rest from the loop thread.
class ThreadedCamera final : public hal::ColorCamera, public hal::ReportingDevice {
 public:
  /// Errors: those of V4l2Camera::make.
  [[nodiscard]] static Result<std::unique_ptr<ThreadedCamera>> make(SystemCalls& system,
                                                                    const V4l2CameraOptions& options);
  ~ThreadedCamera() override;

  [[nodiscard]] const CameraIntrinsics& intrinsics() const override { return camera_->intrinsics(); }
  /// The first call starts the thread's work: it tells what time it is.
  [[nodiscard]] std::optional<hal::Frame> poll(Instant now) override;
  [[nodiscard]] Instant next_due() const override { return due_; }
  [[nodiscard]] hal::StreamCounters counters() const override;
  [[nodiscard]] Status read(const hal::Frame& frame, MutableGrayImage image) override {
    return camera_->read(frame, image);
  }
  [[nodiscard]] bool delivers_color() const override;
  [[nodiscard]] Status read_color(const hal::Frame& frame, ImageView<std::array<std::uint8_t, 3>> image) override {
    return camera_->read_color(frame, image);
  }
  [[nodiscard]] std::optional<hal::CornerObservation> read_corners(const hal::Frame&, int) override { return {}; }
  [[nodiscard]] hal::DeviceReport report(Instant now) const override;

 private:
  ThreadedCamera(SystemCalls& system, std::unique_ptr<V4l2Camera> camera)
      : system_(system), camera_(std::move(camera)) {}
  void work();

  SystemCalls& system_;
  std::unique_ptr<V4l2Camera> camera_;
  Instant due_{};

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<std::int64_t> origin_ns_;  ///< of the loop's time on CLOCK_MONOTONIC
  std::optional<hal::Frame> newest_;
  hal::StreamCounters stream_;
  hal::DeviceReport report_;
  bool color_ = true;
  bool stop_ = false;
  std::optional<Thread> thread_;  ///< last: it is joined first
};

}  // namespace firstlook::v4l2
