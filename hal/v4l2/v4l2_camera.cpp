#include "hal/v4l2/v4l2_camera.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <utility>

namespace firstlook::v4l2 {
namespace {

constexpr Duration kRetry = milliseconds(2);      // between looks for a frame that is due
constexpr Duration kOldest = milliseconds(2000);  // a stamp further back is of another clock
constexpr Duration kLeast = {1000};               // between two stamps
constexpr int kInputErrorsMax = 10;               // in a row; then the device is opened again
constexpr int kBuffersPerPoll = 8;
// When a stream that fell silent is opened again, v4l2loopback hands out the last frame of before, whose feeder may
// hang. Taken for a new one, it would look like a camera that works, again and again.
constexpr int kOldFrames = 1;

/// The most that one frame takes: YUYV has 2 bytes a pixel, JPEG of a camera less.
std::size_t slot_bytes(const CaptureOptions& options) {
  const auto pixels = static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  const bool two = std::ranges::any_of(
      options.formats, [](PixelFormat f) { return f == PixelFormat::kYuyv || f == PixelFormat::kMjpeg; });
  const bool planar = std::ranges::find(options.formats, PixelFormat::kNv12) != options.formats.end();
  return two ? 2 * pixels : planar ? pixels + pixels / 2 : pixels;
}

}  // namespace

FixedVector<ControlSetting, 12> fixed_controls(int exposure_us, int gain, int focus, int white_balance_k) {
  FixedVector<ControlSetting, 12> controls;
  if (exposure_us > 0) {
    controls.push_back({V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, "manual exposure"});
    controls.push_back({V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0, "constant rate"});
    controls.push_back({V4L2_CID_EXPOSURE_ABSOLUTE, std::max(1, (exposure_us + 50) / 100), "exposure"});  // of 100 us
  }
  if (gain >= 0) {
    controls.push_back({V4L2_CID_AUTOGAIN, 0, "manual gain"});
    controls.push_back({V4L2_CID_GAIN, gain, "gain"});
  }
  if (focus >= 0) {
    controls.push_back({V4L2_CID_FOCUS_AUTO, 0, "manual focus"});
    controls.push_back({V4L2_CID_FOCUS_ABSOLUTE, focus, "focus"});
  }
  if (white_balance_k > 0) {
    controls.push_back({V4L2_CID_AUTO_WHITE_BALANCE, 0, "manual white balance"});
    controls.push_back({V4L2_CID_WHITE_BALANCE_TEMPERATURE, white_balance_k, "white balance"});
  }
  return controls;
}

Result<std::unique_ptr<V4l2Camera>> V4l2Camera::make(SystemCalls& system, const V4l2CameraOptions& options) {
  std::unique_ptr<V4l2Camera> camera(new V4l2Camera(system, options));
  camera->backoff_ = options.reopen;
  if (Status status = camera->slots_.make(memory::Pool::kColorSlots, slot_bytes(options.capture)); !status) {
    return std::unexpected(status.error());
  }
  return camera;
}

void V4l2Camera::open(Instant now) {
  if (capture_.open() != CaptureTrouble::kNone) {
    due_ = now + backoff_;
    backoff_ = std::min(backoff_ * 2, options_.reopen_max);
    return;
  }
  const PictureLayout granted = capture_.granted().layout.tight();
  // Frames of the first layout may still be read.
  if (layout_known_ && (granted.format != layout_.format || granted.full_range != layout_.full_range)) {
    layout_changed_ = true;
    capture_.close();
    due_ = now + options_.reopen_max;
    return;
  }
  layout_changed_ = false;
  if (!layout_known_) layout_ = granted;  // not again: jobs may be reading
  layout_known_ = true;
  passes_over_ = silent_ ? kOldFrames : 0;
  driver_sequence_.reset();
  input_errors_in_a_row_ = 0;
  const double rate_hz = capture_.granted().rate_hz > 0 ? capture_.granted().rate_hz : options_.capture.rate_hz;
  period_ = seconds(1 / rate_hz);
  last_frame_ = now;
  due_ = now + period_;
}

void V4l2Camera::lose(Instant now) {
  capture_.close();
  due_ = now + backoff_;
  backoff_ = std::min(backoff_ * 2, options_.reopen_max);
}

std::optional<hal::Frame> V4l2Camera::poll(Instant now) {
  // The smallest difference of the clocks is the one with the least time between asking them.
  const std::int64_t origin_ns = system_.monotonic_ns() - now.ns;
  origin_ns_ = origin_ns_ ? std::min(*origin_ns_, origin_ns) : origin_ns;
  if (!capture_.is_open()) {
    if (now >= due_) open(now);
    return {};
  }
  std::optional<hal::Frame> newest;
  for (int i = 0; i < kBuffersPerPoll; ++i) {
    CapturedBuffer buffer;
    const Capture::Taken taken = capture_.take(buffer);
    if (taken == Capture::Taken::kNothing) break;
    if (taken == Capture::Taken::kInputError) {
      ++counters_.input_errors;
      if (++input_errors_in_a_row_ < kInputErrorsMax) break;
      ++counters_.disconnects;
      lose(now);
      return newest;
    }
    if (taken == Capture::Taken::kLost) {
      ++counters_.disconnects;
      lose(now);
      return newest;
    }
    input_errors_in_a_row_ = 0;
    if (passes_over_ > 0) {
      --passes_over_;
    } else if (const auto frame = accept(buffer, now)) {
      newest = frame;
    }
    last_frame_ = now;
    if (!capture_.give_back(buffer)) {
      ++counters_.disconnects;
      lose(now);
      return newest;
    }
  }
  if (now - last_frame_ > options_.stall) {
    ++counters_.stalls;
    silent_ = true;
    lose(now);
    return newest;
  }
  due_ = std::max(last_frame_ + period_, now + kRetry);
  return newest;
}

/// The frames that the driver did not deliver. A number that steps back is of a driver that began anew.
void V4l2Camera::count_sequence(std::uint32_t sequence) {
  std::uint32_t step = 1;
  if (driver_sequence_) {
    const std::uint32_t ahead = sequence - *driver_sequence_;  // over the end of the numbers, too
    if (ahead > 1 && ahead < 0x80000000U) {
      step = ahead;
      ++counters_.gaps;
    }
  }
  driver_sequence_ = sequence;
  stream_.frames += step;
  stream_.lost += step - 1;
  sequence_ += any_frame_ ? step : step - 1;
  any_frame_ = true;
}

Instant V4l2Camera::stamp_of(const CapturedBuffer& buffer, Instant now) {
  const Duration half{options_.exposure.ns / 2};
  Instant stamp = now - half;
  if (buffer.stamp != StampKind::kUnknown) {
    const Instant told{buffer.monotonic_ns - *origin_ns_};
    if (now - told > kOldest || told - now > kOldest) {
      ++counters_.stamps_unusable;
    } else {
      if (told > now) ++counters_.stamps_late;
      stamp = buffer.stamp == StampKind::kStartOfExposure ? told + half : told - half;
    }
  } else {
    ++counters_.stamps_unusable;
  }
  stamp = std::min(stamp, now);
  if (stream_.frames > stream_.lost + 1) stamp = std::max(stamp, last_stamp_ + kLeast);  // not the first one
  return std::min(stamp, now);
}

std::optional<hal::Frame> V4l2Camera::accept(const CapturedBuffer& buffer, Instant now) {
  count_sequence(buffer.sequence);
  const PictureLayout& given = capture_.granted().layout;
  const bool compressed = given.format == PixelFormat::kMjpeg;
  if (buffer.broken || (compressed ? buffer.bytes.empty() : buffer.bytes.size() < given.bytes())) {
    ++counters_.broken;
    ++stream_.lost;
    return {};
  }
  hal::Frame frame{stamp_of(buffer, now), sequence_, 0};
  const std::size_t size = compressed ? buffer.bytes.size() : layout_.bytes();
  const auto copy = [&](std::span<std::uint8_t> slot) { copy_tight(given, buffer.bytes, slot); };
  if (!slots_.store(size, frame, copy)) {
    ++counters_.slots_busy;
    ++stream_.lost;
    return {};
  }
  last_stamp_ = frame.stamp;
  worked_ = true;
  silent_ = false;
  backoff_ = options_.reopen;
  return frame;
}

Status V4l2Camera::read(const hal::Frame& frame, MutableGrayImage image) {
  return slots_.with(frame, [&](std::span<const std::uint8_t> bytes) { return to_gray(layout_, bytes, image); });
}

Status V4l2Camera::read_color(const hal::Frame& frame, ImageView<std::array<std::uint8_t, 3>> image) {
  return slots_.with(frame, [&](std::span<const std::uint8_t> bytes) { return to_rgb(layout_, bytes, image); });
}

}  // namespace firstlook::v4l2
