/// A Kinect v1: its depth camera, and its colour camera in grey values.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "hal/api/cameras.hpp"
#include "hal/api/device_clock.hpp"
#include "hal/api/device_report.hpp"
#include "hal/api/frame_slots.hpp"
#include "hal/api/last_resort.hpp"
#include "hal/freenect/kinect_usb.hpp"
#include "platform/linux/system_calls.hpp"
#include "platform/linux/thread.hpp"

namespace firstlook::freenect {

struct KinectOptions {
  KinectUsbOptions usb;
  std::optional<CameraIntrinsics>
      depth_intrinsics;  ///< empty: of a Kinect as it is built, good enough to see something
  std::optional<CameraIntrinsics> color_intrinsics;
  Duration stall = milliseconds(1000);  ///< without a frame of one of its cameras for so long, it is opened again
  Duration reopen = milliseconds(1000);
  Duration boot_wait = milliseconds(5000);  ///< how long make() waits for the first opening to end, well or not
  hal::LastResort last_resort{};
  std::function<void()> reset{};  ///< of the device on its bus, when opening it again did not help; may block
};

/// Numbers the frames of one camera by its clock, 60 MHz in 32 bits: the library does not count them.
class TickCounter {
 public:
  explicit TickCounter(double rate_hz) : period_ticks_(kTicks_hz / rate_hz) {}
  struct Step {
    std::int64_t device_ns = 0;  ///< goes on where the ticks begin anew, every 71 s
    std::uint32_t frames = 1;    ///< since the last one: more than one were lost
  };
  [[nodiscard]] Step next(std::uint32_t ticks);
  void begin_anew() { last_.reset(); }

 private:
  static constexpr double kTicks_hz = 60e6;
  double period_ticks_;
  std::optional<std::uint32_t> last_;
  std::int64_t total_ticks_ = 0;
};

/// What the thread of a Kinect leaves of one camera for the loop.
class KinectStream {
 public:
  KinectStream(double rate_hz, memory::Pool pool, std::size_t bytes) : ticks_(rate_hz), pool_(pool), bytes_(bytes) {}
  [[nodiscard]] Status make() { return slots_.make(pool_, bytes_); }

  // The thread.
  template <typename Copy>
  void accept(std::uint32_t ticks, std::int64_t arrived_ns, Copy copy);
  void begin_anew(std::int64_t now_ns);
  [[nodiscard]] bool stalled(std::int64_t now_ns, Duration limit) const { return now_ns - last_ns_ > limit.ns; }

  // The loop.
  [[nodiscard]] std::optional<hal::Frame> poll(SystemCalls& system, Instant now);
  [[nodiscard]] hal::StreamCounters counters() const;

  // Any.
  [[nodiscard]] const hal::FrameSlots& slots() const { return slots_; }

 private:
  TickCounter ticks_;
  memory::Pool pool_;
  std::size_t bytes_;
  hal::FrameSlots slots_;
  hal::DeviceClock clock_;
  std::uint32_t sequence_ = 0;
  std::int64_t last_ns_ = 0;

  mutable std::mutex mutex_;
  std::optional<hal::Frame> newest_;
  hal::StreamCounters counters_;

  std::optional<std::int64_t> origin_ns_;
  Instant last_stamp_{-1};
};

/// One thread of ours runs the library: opens, waits, copies, opens again; the loop looks at what it left. depth() and
/// color() live as long as the Kinect; ask only for what the options asked for.
class Kinect final : private KinectFrames {
 public:
  /// Error: kOutOfMemory. A device that is not there is no error: it is looked for again and again, and report() tells.
  [[nodiscard]] static Result<std::unique_ptr<Kinect>> make(SystemCalls& system, const KinectOptions& options);
  ~Kinect() override;

  [[nodiscard]] hal::DepthCamera& depth();
  [[nodiscard]] hal::ColorCamera& color();
  [[nodiscard]] const hal::ReportingDevice& depth_report() const;
  [[nodiscard]] const hal::ReportingDevice& color_report() const;

 private:
  class DepthSide;
  class ColorSide;
  enum class Phase : std::uint8_t { kStarting, kStreaming, kFailed, kSilent };

  Kinect(SystemCalls& system, const KinectOptions& options);
  void depth_came(std::span<const std::uint16_t, kPixels> pixels, std::uint32_t ticks) override;
  void color_came(std::span<const std::uint8_t, 2 * kPixels> bytes, std::uint32_t ticks) override;
  void work();
  void stream(KinectUsb& usb);
  void reset_if_silent(bool frames_came);
  [[nodiscard]] hal::DeviceReport report(const KinectStream& stream) const;

  SystemCalls& system_;
  KinectOptions options_;
  KinectStream depth_, color_;
  std::unique_ptr<DepthSide> depth_camera_;
  std::unique_ptr<ColorSide> color_camera_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Phase phase_ = Phase::kStarting;
  KinectTrouble trouble_ = KinectTrouble::kNone;
  std::uint64_t opens_ = 0, stalls_ = 0, disconnects_ = 0, resets_ = 0;
  bool stop_ = false;
  std::optional<Thread> thread_;  ///< last: it is joined first
};

}  // namespace firstlook::freenect
