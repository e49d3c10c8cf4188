#include "hal/freenect/kinect.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

namespace firstlook::freenect {
namespace {

constexpr int kWait_ms = 100;
constexpr Duration kRetry = milliseconds(8);  // of the loop, between looks for a frame: a turn of the arm
constexpr double kDepthRate_hz = 30, kColorRate_hz = 15;

// The thesis of 2014: depth has 57 by 43 degrees; its own calibration of a Kinect's colour camera at 640 x 480.
CameraIntrinsics depth_as_built() {
  constexpr double kHalfWidth_rad = 57.0 / 2 * M_PI / 180;
  const double f = kWidth / 2.0 / std::tan(kHalfWidth_rad);
  return {kWidth, kHeight, f, f, (kWidth - 1) / 2.0, (kHeight - 1) / 2.0};
}
constexpr CameraIntrinsics kColorAsBuilt{kWidth,  kHeight,  537.33,   538.35,  321.61, 252.18,
                                         0.17938, -0.31818, -0.00268, 0.00209, 0};

template <typename Image>
Status check_size(const Image& image) {
  if (image.data != nullptr && image.width == kWidth && image.height == kHeight) return {};
  return failure(Fault::kFrameRefused, "the image is {} x {}, the Kinect's {} x {}", image.width, image.height, kWidth,
                 kHeight);
}

void tell_trouble(KinectTrouble trouble, hal::DeviceReport& report) {
  switch (trouble) {
    case KinectTrouble::kNone:
      report.detail.set("it was disconnected");
      report.remedy.set("Plug it in again; check its own power supply.");
      break;
    case KinectTrouble::kLibrary:
      report.detail.set("libfreenect does not start: no USB");
      report.remedy.set("Check that /dev/bus/usb is there.");
      break;
    case KinectTrouble::kNoDevice:
      report.detail.set("no Kinect is there");
      report.remedy.set("Plug in its USB cable and its own power supply; lsusb shows 045e:02ae when it has both.");
      break;
    case KinectTrouble::kNotOpen:
      report.detail.set("it cannot be opened");
      report.remedy.set(
          "Put the program's user into the group plugdev, end what else uses it (gspca_kinect: rmmod), check its "
          "serial "
          "number.");
      break;
    case KinectTrouble::kNoMode:
      report.detail.set("it refuses the mode");
      report.remedy.set("Unplug it and plug it in again.");
      break;
    case KinectTrouble::kNotStarted:
      report.detail.set("its stream does not start");
      report.remedy.set("Give it a USB 2 controller of its own: it needs most of the bandwidth of one.");
      break;
  }
}

}  // namespace

TickCounter::Step TickCounter::next(std::uint32_t ticks) {
  Step step;
  if (last_) {
    const std::uint32_t passed = ticks - *last_;  // over the end of the ticks, too
    total_ticks_ += passed;
    step.frames = static_cast<std::uint32_t>(std::max(1.0, std::round(passed / period_ticks_)));
  }
  last_ = ticks;
  step.device_ns = static_cast<std::int64_t>(static_cast<double>(total_ticks_) * 1e9 / kTicks_hz);
  return step;
}

template <typename Copy>
void KinectStream::accept(std::uint32_t ticks, std::int64_t arrived_ns, Copy copy) {
  const TickCounter::Step step = ticks_.next(ticks);
  sequence_ += step.frames;
  last_ns_ = arrived_ns;
  hal::Frame frame{Instant{clock_.ours_ns(step.device_ns, arrived_ns)}, sequence_ - 1, 0};
  const bool stored = slots_.store(bytes_, frame, copy);
  const std::scoped_lock lock(mutex_);
  counters_.frames += step.frames;
  counters_.lost += step.frames - (stored ? 1 : 0);
  if (stored) newest_ = frame;
}

void KinectStream::begin_anew(std::int64_t now_ns) {
  ticks_.begin_anew();
  clock_ = {};
  last_ns_ = now_ns;
}

std::optional<hal::Frame> KinectStream::poll(SystemCalls& system, Instant now) {
  const std::int64_t origin_ns = system.monotonic_ns() - now.ns;
  origin_ns_ = origin_ns_ ? std::min(*origin_ns_, origin_ns) : origin_ns;
  std::optional<hal::Frame> frame;
  {
    const std::scoped_lock lock(mutex_);
    frame = std::exchange(newest_, std::nullopt);
  }
  if (!frame) return {};
  frame->stamp = {frame->stamp.ns - *origin_ns_};
  frame->stamp = std::min(std::max(frame->stamp, last_stamp_ + Duration{1000}), now);
  last_stamp_ = frame->stamp;
  return frame;
}

hal::StreamCounters KinectStream::counters() const {
  const std::scoped_lock lock(mutex_);
  return counters_;
}

class Kinect::DepthSide final : public hal::DepthCamera, public hal::ReportingDevice {
 public:
  explicit DepthSide(Kinect& kinect)
      : kinect_(kinect), intrinsics_(kinect.options_.depth_intrinsics.value_or(depth_as_built())) {}
  const CameraIntrinsics& intrinsics() const override { return intrinsics_; }
  std::optional<hal::Frame> poll(Instant now) override {
    due_ = now + kRetry;
    return kinect_.depth_.poll(kinect_.system_, now);
  }
  Instant next_due() const override { return due_; }
  hal::StreamCounters counters() const override { return kinect_.depth_.counters(); }
  double units_per_m() const override { return 1000; }
  Status read(const hal::Frame& frame, ImageView<std::uint16_t> image) override {
    if (Status status = check_size(image); !status) return status;
    return kinect_.depth_.slots().with(frame, [&](std::span<const std::uint8_t> bytes) -> Status {
      std::memcpy(image.data, bytes.data(), bytes.size());
      return {};
    });
  }
  hal::DeviceReport report(Instant) const override { return kinect_.report(kinect_.depth_); }

 private:
  Kinect& kinect_;
  CameraIntrinsics intrinsics_;
  Instant due_{};
};

class Kinect::ColorSide final : public hal::ColorCamera, public hal::ReportingDevice {
 public:
  explicit ColorSide(Kinect& kinect)
      : kinect_(kinect), intrinsics_(kinect.options_.color_intrinsics.value_or(kColorAsBuilt)) {}
  const CameraIntrinsics& intrinsics() const override { return intrinsics_; }
  std::optional<hal::Frame> poll(Instant now) override {
    due_ = now + kRetry;
    return kinect_.color_.poll(kinect_.system_, now);
  }
  Instant next_due() const override { return due_; }
  hal::StreamCounters counters() const override { return kinect_.color_.counters(); }
  Status read(const hal::Frame& frame, MutableGrayImage image) override {
    if (Status status = check_size(image); !status) return status;
    return kinect_.color_.slots().with(frame, [&](std::span<const std::uint8_t> bytes) -> Status {
      std::ranges::copy(bytes, image.data);
      return {};
    });
  }
  std::optional<hal::CornerObservation> read_corners(const hal::Frame&, int) override { return {}; }
  hal::DeviceReport report(Instant) const override { return kinect_.report(kinect_.color_); }

 private:
  Kinect& kinect_;
  CameraIntrinsics intrinsics_;
  Instant due_{};
};

Kinect::Kinect(SystemCalls& system, const KinectOptions& options)
    : system_(system),
      options_(options),
      depth_(kDepthRate_hz, memory::Pool::kDepthSlots, kPixels * sizeof(std::uint16_t)),
      color_(kColorRate_hz, memory::Pool::kColorSlots, kPixels),
      depth_camera_(std::make_unique<DepthSide>(*this)),
      color_camera_(std::make_unique<ColorSide>(*this)) {}

Result<std::unique_ptr<Kinect>> Kinect::make(SystemCalls& system, const KinectOptions& options) {
  std::unique_ptr<Kinect> kinect(new Kinect(system, options));
  if (options.usb.depth) {
    if (Status status = kinect->depth_.make(); !status) return std::unexpected(status.error());
  }
  if (options.usb.color) {
    if (Status status = kinect->color_.make(); !status) return std::unexpected(status.error());
  }
  kinect->thread_.emplace("freenect", [k = kinect.get()] { k->work(); });
  std::unique_lock lock(kinect->mutex_);
  kinect->changed_.wait_for(lock, std::chrono::nanoseconds(options.boot_wait.ns),
                            [&] { return kinect->phase_ != Phase::kStarting; });
  return kinect;
}

Kinect::~Kinect() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.reset();
}

hal::DepthCamera& Kinect::depth() { return *depth_camera_; }
hal::ColorCamera& Kinect::color() { return *color_camera_; }
const hal::ReportingDevice& Kinect::depth_report() const { return *depth_camera_; }
const hal::ReportingDevice& Kinect::color_report() const { return *color_camera_; }

void Kinect::depth_came(std::span<const std::uint16_t, kPixels> pixels, std::uint32_t ticks) {
  depth_.accept(ticks, system_.monotonic_ns(),
                [&](std::span<std::uint8_t> slot) { std::memcpy(slot.data(), pixels.data(), slot.size()); });
}

/// Of U Y V Y the second and fourth byte.
void Kinect::color_came(std::span<const std::uint8_t, 2 * kPixels> bytes, std::uint32_t ticks) {
  color_.accept(ticks, system_.monotonic_ns(), [&](std::span<std::uint8_t> slot) {
    for (std::size_t i = 0; i < slot.size(); ++i) slot[i] = bytes[2 * i + 1];
  });
}

/// The thread: opens, streams, opens again.
void Kinect::work() {
  KinectUsb usb;
  for (;;) {
    depth_.begin_anew(system_.monotonic_ns());
    color_.begin_anew(system_.monotonic_ns());
    const KinectTrouble trouble = usb.open(options_.usb, *this);
    {
      const std::scoped_lock lock(mutex_);
      trouble_ = trouble;
      if (trouble == KinectTrouble::kNone) ++opens_;
      if (trouble != KinectTrouble::kNone) {
        phase_ = Phase::kFailed;
      } else if (phase_ != Phase::kSilent) {
        phase_ = Phase::kStreaming;
      }
    }
    changed_.notify_all();
    const std::uint64_t depth_before = depth_.counters().frames, color_before = color_.counters().frames;
    if (trouble == KinectTrouble::kNone) stream(usb);
    const bool frames_came = (!options_.usb.depth || depth_.counters().frames > depth_before) &&
                             (!options_.usb.color || color_.counters().frames > color_before);
    usb.close();
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, std::chrono::nanoseconds(options_.reopen.ns), [&] { return stop_; });
      if (stop_) return;
    }
    reset_if_silent(frames_came);
  }
}

void Kinect::reset_if_silent(bool frames_came) {
  if (frames_came) options_.last_resort.frame_came();
  if (!options_.reset || !options_.last_resort.due({system_.monotonic_ns()})) return;
  {
    const std::scoped_lock lock(mutex_);
    ++resets_;
  }
  options_.reset();
}

void Kinect::stream(KinectUsb& usb) {
  const std::int64_t opened_ns = system_.monotonic_ns();
  depth_.begin_anew(opened_ns);
  color_.begin_anew(opened_ns);
  for (;;) {
    const bool well = usb.process(kWait_ms);
    const std::int64_t now_ns = system_.monotonic_ns();
    const bool stalled = (options_.usb.depth && depth_.stalled(now_ns, options_.stall)) ||
                         (options_.usb.color && color_.stalled(now_ns, options_.stall));
    const std::scoped_lock lock(mutex_);
    if (stop_) return;
    if (!well) {
      ++disconnects_;
      phase_ = Phase::kFailed;
      return;
    }
    if (stalled) {
      ++stalls_;
      phase_ = Phase::kSilent;
      return;
    }
    // Silence ends with a while in which both cameras delivered.
    if (now_ns - opened_ns > options_.stall.ns) phase_ = Phase::kStreaming;
  }
}

hal::DeviceReport Kinect::report(const KinectStream& stream) const {
  using hal::DeviceState;
  const hal::StreamCounters counters = stream.counters();
  const std::scoped_lock lock(mutex_);
  hal::DeviceReport report;
  report.device.set("Kinect{}{}", options_.usb.serial.empty() ? "" : " ", options_.usb.serial);
  const DeviceState gone = counters.frames > 0 ? DeviceState::kLost : DeviceState::kMissing;
  switch (phase_) {
    case Phase::kStarting:
      report.state = DeviceState::kStarting;
      report.detail.set("is being opened");
      break;
    case Phase::kStreaming:
      report.state = counters.frames > 0 ? DeviceState::kReady : DeviceState::kStarting;
      report.detail.set("{} x {}", kWidth, kHeight);
      break;
    case Phase::kSilent:
      report.state = gone;
      report.detail.set("no frame came for {:.1f} s", options_.stall.seconds());
      report.remedy.set("Check its own power supply, and give it a USB 2 controller of its own.");
      break;
    case Phase::kFailed:
      report.state = gone;
      tell_trouble(trouble_, report);
      break;
  }
  const auto count = [&](std::string_view name, std::uint64_t value) { report.add(name, static_cast<double>(value)); };
  count("frames", counters.frames);
  count("frames_lost", counters.lost);
  count("opens", opens_);
  count("stalls", stalls_);
  count("disconnects", disconnects_);
  count("resets", resets_);
  return report;
}

}  // namespace firstlook::freenect
