#include "hal/openni/openni_depth.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

namespace firstlook::openni {
namespace {

constexpr int kWait_ms = 100;
constexpr Duration kRetry = milliseconds(8);  // of the loop, for what the thread left: a turn of the arm
constexpr std::size_t kPixelBytes = 2;

/// A pinhole with the field of view that a device states: its picture is that wide at the outer edges of its pixels.
CameraIntrinsics by_field_of_view(int width, int height, double horizontal_rad, double vertical_rad) {
  CameraIntrinsics k{width, height};
  k.cx = (width - 1) / 2.0;
  k.cy = (height - 1) / 2.0;
  if (horizontal_rad <= 0 || horizontal_rad >= 3) return k;
  k.fx = width / 2.0 / std::tan(horizontal_rad / 2);
  k.fy = vertical_rad > 0 && vertical_rad < 3 ? height / 2.0 / std::tan(vertical_rad / 2) : k.fx;
  return k;
}

/// Row by row, backwards where the picture is mirrored.
void copy_rows(const SensorFrame& frame, bool mirrored, std::uint8_t* to) {
  const std::size_t row = static_cast<std::size_t>(frame.width) * kPixelBytes;
  for (int y = 0; y < frame.height; ++y) {
    const std::uint8_t* const from = frame.rows + static_cast<std::ptrdiff_t>(y) * frame.stride;
    std::uint8_t* const line = to + static_cast<std::size_t>(y) * row;
    std::memcpy(line, from, row);
    if (!mirrored) continue;
    for (std::size_t a = 0, b = row - kPixelBytes; a < b; a += kPixelBytes, b -= kPixelBytes) {
      std::swap_ranges(line + a, line + a + kPixelBytes, line + b);
    }
  }
}

}  // namespace

Result<std::unique_ptr<OpenNiDepth>> OpenNiDepth::make(SystemCalls& system, const OpenNiDepthOptions& options) {
  std::unique_ptr<OpenNiDepth> camera(new OpenNiDepth(system, options));
  const auto pixels = static_cast<std::size_t>(options.sensor.width) * static_cast<std::size_t>(options.sensor.height);
  if (Status status = camera->slots_.make(memory::Pool::kDepthSlots, pixels * kPixelBytes); !status) {
    return std::unexpected(status.error());
  }
  camera->intrinsics_ =
      options.intrinsics.value_or(by_field_of_view(options.sensor.width, options.sensor.height, 0, 0));
  camera->thread_.emplace("openni", [c = camera.get()] { c->work(); });
  std::unique_lock lock(camera->mutex_);
  camera->changed_.wait_for(lock, std::chrono::nanoseconds(options.boot_wait.ns),
                            [&] { return camera->shared_.phase != Phase::kStarting; });
  if (camera->shared_.phase == Phase::kStreaming) camera->take_up(camera->shared_.info);
  return camera;
}

OpenNiDepth::~OpenNiDepth() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.reset();
}

void OpenNiDepth::pause(Duration time) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, std::chrono::nanoseconds(time.ns), [&] { return stop_; });
}

/// The thread: opens, streams, opens again.
void OpenNiDepth::work() {
  Sensor sensor;
  for (;;) {
    const SensorTrouble trouble = sensor.open(options_.sensor);
    bool over = false;
    {
      const std::scoped_lock lock(mutex_);
      shared_.trouble = trouble;
      shared_.words = sensor.words();
      if (trouble == SensorTrouble::kNone) {
        shared_.info = sensor.info();
        ++shared_.counters.opens;
      }
      // One that stalled is opened without complaint: it streams only when frames come.
      if (trouble != SensorTrouble::kNone) {
        shared_.phase = Phase::kFailed;
      } else if (shared_.phase != Phase::kSilent) {
        shared_.phase = Phase::kStreaming;
      }
      over = stop_;
    }
    changed_.notify_all();
    if (trouble == SensorTrouble::kNone && !over) stream(sensor);
    sensor.close();
    pause(options_.reopen);
    reset_if_silent();
    const std::scoped_lock lock(mutex_);
    if (stop_ || shared_.phase == Phase::kEnded) return;
  }
}

void OpenNiDepth::reset_if_silent() {
  if (index_) options_.last_resort.frame_came();
  index_.reset();
  if (!options_.reset || !options_.last_resort.due({system_.monotonic_ns()})) return;
  {
    const std::scoped_lock lock(mutex_);
    if (stop_) return;
    ++shared_.counters.resets;
  }
  options_.reset();
}

void OpenNiDepth::stream(Sensor& sensor) {
  index_.reset();
  std::int64_t last_ns = system_.monotonic_ns();
  for (;;) {
    SensorFrame frame;
    const Sensor::Waited waited = sensor.wait(kWait_ms, frame);
    if (waited == Sensor::Waited::kFrame) {
      last_ns = system_.monotonic_ns();
      accept(sensor, frame);
    }
    const std::scoped_lock lock(mutex_);
    if (stop_) return;
    if (waited == Sensor::Waited::kFailed) {
      ++shared_.counters.disconnects;
      shared_.phase = Phase::kFailed;
      shared_.trouble = SensorTrouble::kNotOpen;
      return;
    }
    if (system_.monotonic_ns() - last_ns > options_.stall.ns) {
      ++shared_.counters.stalls;
      shared_.phase = sensor.info().is_file && shared_.worked ? Phase::kEnded : Phase::kSilent;
      return;
    }
  }
}

void OpenNiDepth::accept(const Sensor& sensor, const SensorFrame& frame) {
  const std::int64_t arrived_ns = system_.monotonic_ns();
  // A number that steps back is of a device that began anew.
  const std::uint32_t ahead = index_ ? frame.index - *index_ : 1;
  const std::uint32_t step = ahead >= 1 && ahead < 0x80000000U ? ahead : 1;
  index_ = frame.index;
  sequence_ += step;
  hal::Frame kept{Instant{clock_.ours_ns(frame.device_us * 1000, arrived_ns)}, sequence_ - 1, 0};
  const bool fits = frame.width == options_.sensor.width && frame.height == options_.sensor.height;
  const bool stored = fits && slots_.store(slots_.bytes_each(), kept, [&](std::span<std::uint8_t> slot) {
    copy_rows(frame, sensor.info().mirrored, slot.data());
  });
  const std::scoped_lock lock(mutex_);
  shared_.stream.frames += step;
  shared_.stream.lost += step - (stored ? 1 : 0);
  if (!fits) ++shared_.counters.other_size;
  if (fits && !stored) ++shared_.counters.slots_busy;
  if (!stored) return;
  shared_.phase = Phase::kStreaming;
  shared_.worked = true;
  shared_.newest = kept;
  shared_.last_frame_ns = arrived_ns;
}

/// What a device says of itself holds from its first opening on: another one in its place must be alike.
void OpenNiDepth::take_up(const SensorInfo& info) {
  taken_up_ = true;
  units_per_m_ = info.units_per_m;
  if (options_.intrinsics) return;
  intrinsics_ =
      by_field_of_view(options_.sensor.width, options_.sensor.height, info.horizontal_fov_rad, info.vertical_fov_rad);
}

std::optional<hal::Frame> OpenNiDepth::poll(Instant now) {
  const std::int64_t origin_ns = system_.monotonic_ns() - now.ns;
  origin_ns_ = origin_ns_ ? std::min(*origin_ns_, origin_ns) : origin_ns;
  due_ = now + kRetry;
  const std::scoped_lock lock(mutex_);
  if (!shared_.newest) return {};
  if (!taken_up_) take_up(shared_.info);
  hal::Frame frame = *std::exchange(shared_.newest, std::nullopt);
  frame.stamp = {frame.stamp.ns - *origin_ns_};
  if (frame.stamp > now) ++shared_.counters.stamps_late;
  frame.stamp = std::min(std::max(frame.stamp, last_stamp_ + Duration{1000}), now);
  last_stamp_ = frame.stamp;
  return frame;
}

hal::StreamCounters OpenNiDepth::counters() const {
  const std::scoped_lock lock(mutex_);
  return shared_.stream;
}

OpenNiCounters OpenNiDepth::more_counters() const {
  const std::scoped_lock lock(mutex_);
  return shared_.counters;
}

Status OpenNiDepth::read(const hal::Frame& frame, ImageView<std::uint16_t> image) {
  if (image.data == nullptr || image.width != options_.sensor.width || image.height != options_.sensor.height) {
    return failure(Fault::kFrameRefused, "the image is {} x {}, the camera's {} x {}", image.width, image.height,
                   options_.sensor.width, options_.sensor.height);
  }
  return slots_.with(frame, [&](std::span<const std::uint8_t> bytes) -> Status {
    std::memcpy(image.data, bytes.data(), bytes.size());
    return {};
  });
}

}  // namespace firstlook::openni
