/// A depth camera through OpenNI 2: PrimeSense, Xtion, and .oni recordings.
#pragma once

#include <atomic>
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
#include "hal/openni/sensor.hpp"
#include "platform/linux/system_calls.hpp"
#include "platform/linux/thread.hpp"

namespace firstlook::openni {

struct OpenNiDepthOptions {
  SensorOptions sensor;
  std::optional<CameraIntrinsics> intrinsics;  ///< of the size asked for; empty: by the field of view of the device
  Duration stall = milliseconds(1000);         ///< without a frame for so long, the device is opened again
  Duration reopen = milliseconds(1000);
  Duration boot_wait = milliseconds(5000);  ///< how long make() waits for the first opening to end, well or not
  hal::LastResort last_resort{};
  std::function<void()> reset{};  ///< of the device on its bus, when opening it again did not help; may block
};

struct OpenNiCounters {
  std::uint64_t stalls = 0, disconnects = 0, opens = 0;
  std::uint64_t other_size = 0;  ///< frames of another size than asked for; in StreamCounters::lost
  std::uint64_t slots_busy = 0;  ///< frames not kept, because a job was reading the slot; in lost
  std::uint64_t stamps_late = 0;
  std::uint64_t resets = 0;
};

/// The library blocks and makes threads of its own, so one thread of ours opens, waits, copies, and opens again; the
/// loop only looks at what it left. A recording is played once, at its own pace.
class OpenNiDepth final : public hal::DepthCamera, public hal::ReportingDevice {
 public:
  /// Error: kOutOfMemory when 32 frames of this size do not fit the memory page. A device that is not there is no
  /// error: it is looked for again and again, and report() tells.
  [[nodiscard]] static Result<std::unique_ptr<OpenNiDepth>> make(SystemCalls& system,
                                                                 const OpenNiDepthOptions& options);
  ~OpenNiDepth() override;

  /// fx is 0 as long as neither configuration nor a device has told them.
  [[nodiscard]] const CameraIntrinsics& intrinsics() const override { return intrinsics_; }
  [[nodiscard]] std::optional<hal::Frame> poll(Instant now) override;
  [[nodiscard]] Instant next_due() const override { return due_; }
  [[nodiscard]] hal::StreamCounters counters() const override;
  [[nodiscard]] double units_per_m() const override { return units_per_m_; }
  [[nodiscard]] Status read(const hal::Frame& frame, ImageView<std::uint16_t> image) override;
  [[nodiscard]] hal::DeviceReport report(Instant now) const override;
  [[nodiscard]] OpenNiCounters more_counters() const;

 private:
  enum class Phase : std::uint8_t { kStarting, kStreaming, kFailed, kSilent, kEnded };
  /// What the thread leaves for the loop.
  struct Shared {
    Phase phase = Phase::kStarting;
    SensorTrouble trouble = SensorTrouble::kNone;
    SensorInfo info;
    FixedText<160> words;
    hal::StreamCounters stream;
    OpenNiCounters counters;
    bool worked = false;
    std::optional<hal::Frame> newest;  ///< its stamp is of CLOCK_MONOTONIC
    std::int64_t last_frame_ns = 0;
  };

  OpenNiDepth(SystemCalls& system, const OpenNiDepthOptions& options) : system_(system), options_(options) {}
  void work();
  void stream(Sensor& sensor);
  void reset_if_silent();
  void accept(const Sensor& sensor, const SensorFrame& frame);
  void pause(Duration time);
  void take_up(const SensorInfo& info);

  SystemCalls& system_;
  OpenNiDepthOptions options_;
  hal::FrameSlots slots_;

  // The thread's.
  hal::DeviceClock clock_;
  std::optional<std::uint32_t> index_;
  std::uint32_t sequence_ = 0;

  // The loop's.
  CameraIntrinsics intrinsics_;
  double units_per_m_ = 1000;
  bool taken_up_ = false;
  Instant last_stamp_{-1};
  Instant due_{};
  std::optional<std::int64_t> origin_ns_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Shared shared_;
  bool stop_ = false;
  std::optional<Thread> thread_;  ///< last: it is joined first
};

}  // namespace firstlook::openni
