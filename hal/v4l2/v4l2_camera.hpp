/// A colour or grey camera on V4L2.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "hal/api/cameras.hpp"
#include "hal/api/device_report.hpp"
#include "hal/api/frame_slots.hpp"
#include "hal/v4l2/capture.hpp"

namespace firstlook::v4l2 {

struct V4l2CameraOptions {
  CaptureOptions capture;
  CameraIntrinsics intrinsics;  ///< of the size that is asked for
  Duration exposure{};          ///< fixed by the controls; half of it moves the stamp to the middle. 0: not known
  Duration stall = milliseconds(1000);  ///< without a frame for so long, the device is opened again
  Duration reopen = milliseconds(500);  ///< after a failure; twice as long after each further one
  Duration reopen_max = milliseconds(8000);
};

/// The controls that hold a camera still for calibration; see Config::Camera for the values that leave one alone.
[[nodiscard]] FixedVector<ControlSetting, 12> fixed_controls(int exposure_us, int gain, int focus, int white_balance_k);

struct V4l2Counters {
  std::uint64_t broken = 0;           ///< frames that the driver flagged, or too short ones; in StreamCounters::lost
  std::uint64_t gaps = 0;             ///< times that the driver's sequence jumped
  std::uint64_t input_errors = 0;     ///< EIO
  std::uint64_t stalls = 0;           ///< no frame came, and no error
  std::uint64_t disconnects = 0;      ///< the device went away or failed while it streamed
  std::uint64_t stamps_late = 0;      ///< later than the moment at which the frame was taken: cut to it
  std::uint64_t stamps_unusable = 0;  ///< of no known clock, or far off: the moment of taking counts
  std::uint64_t slots_busy = 0;       ///< frames not kept: a job was reading the slot, or a JPEG is larger than one
};

/// poll, next_due, counters and report from the loop thread; read and read_color from any.
/// A frame is copied once, as the driver gave it; pixels are made by who reads them. poll() does not block while the
/// camera streams; opening it, at first and after a loss, asks the camera and can take up to a second with USB:
/// ThreadedCamera keeps that away from the loop.
class V4l2Camera final : public hal::ColorCamera, public hal::ReportingDevice {
 public:
  /// Takes the memory; the device is opened by the first poll. Error: kOutOfMemory when 32 frames of this size do not
  /// fit the memory page.
  [[nodiscard]] static Result<std::unique_ptr<V4l2Camera>> make(SystemCalls& system, const V4l2CameraOptions& options);

  [[nodiscard]] const CameraIntrinsics& intrinsics() const override { return options_.intrinsics; }
  [[nodiscard]] std::optional<hal::Frame> poll(Instant now) override;
  [[nodiscard]] Instant next_due() const override { return due_; }
  [[nodiscard]] hal::StreamCounters counters() const override { return stream_; }
  [[nodiscard]] Status read(const hal::Frame& frame, MutableGrayImage image) override;
  [[nodiscard]] bool delivers_color() const override { return layout_.format != PixelFormat::kGrey; }
  [[nodiscard]] Status read_color(const hal::Frame& frame, ImageView<std::array<std::uint8_t, 3>> image) override;
  [[nodiscard]] std::optional<hal::CornerObservation> read_corners(const hal::Frame&, int) override { return {}; }
  [[nodiscard]] hal::DeviceReport report(Instant now) const override;

  /// Waits for a frame of an open camera; see Capture::wait.
  [[nodiscard]] bool wait(int longest_ms) const { return capture_.wait(longest_ms); }
  [[nodiscard]] bool is_open() const { return capture_.is_open(); }
  [[nodiscard]] const V4l2Counters& more_counters() const { return counters_; }

 private:
  V4l2Camera(SystemCalls& system, const V4l2CameraOptions& options)
      : system_(system), options_(options), capture_(system, options.capture) {
    layout_.width = options.capture.width;
    layout_.height = options.capture.height;
  }
  void open(Instant now);
  void lose(Instant now);
  void tell_silence(hal::DeviceReport& report) const;
  [[nodiscard]] std::optional<hal::Frame> accept(const CapturedBuffer& buffer, Instant now);
  void count_sequence(std::uint32_t sequence);
  [[nodiscard]] Instant stamp_of(const CapturedBuffer& buffer, Instant now);

  SystemCalls& system_;
  V4l2CameraOptions options_;
  Capture capture_;
  PictureLayout layout_;  ///< of the slots: as granted at the first opening, without padding
  bool layout_known_ = false;
  bool layout_changed_ = false;
  hal::FrameSlots slots_;
  hal::StreamCounters stream_;
  V4l2Counters counters_;
  bool worked_ = false;
  bool silent_ = false;  ///< stalled, and no frame came since
  std::optional<std::uint32_t> driver_sequence_;
  std::uint32_t sequence_ = 0;
  bool any_frame_ = false;
  Instant last_stamp_{};
  Instant last_frame_{};  ///< when it was taken; when streaming began before the first
  Instant due_{};
  Duration period_{};
  Duration backoff_{};
  std::optional<std::int64_t> origin_ns_;  ///< of the loop's time on CLOCK_MONOTONIC
  int input_errors_in_a_row_ = 0;
  int passes_over_ = 0;  ///< frames from before a silence
};

}  // namespace firstlook::v4l2
