#include "app/check/device_check.hpp"

#include <algorithm>

#include "hal/api/repeated_picture.hpp"

namespace firstlook {
namespace {

using hal::DeviceReport;
using hal::DeviceState;

constexpr double kWatched_s = 1;
constexpr double kPatience_s = 6;  // two resets of a panel, or the opening of a USB camera
constexpr Duration kLeastStep = milliseconds(1);

/// The device's own report, or a blank one that counts as ready until something else is seen.
DeviceReport report_of(const hal::ReportingDevice* own, Instant now) {
  if (own != nullptr) return own->report(now);
  DeviceReport report;
  report.state = DeviceState::kReady;
  return report;
}

void add_number(DeviceReport& report, std::string_view name, double value) {
  if (!report.numbers.full()) report.add(name, value);
}

void fall_silent(DeviceReport& report, std::string_view what, std::string_view remedy) {
  report.state = DeviceState::kMissing;
  report.detail.set("{}", what);
  report.remedy.set("{}", remedy);
}

class WatchedStream : public WatchedDevice {
 public:
  WatchedStream(hal::FrameStream& stream, const hal::ReportingDevice* own) : stream_(stream), own_(own) {}
  void poll(Instant now) override {
    const auto frame = stream_.poll(now);
    if (!frame) return;
    look_at(*frame);
    if (frames_++ == 0) first_ = frame->stamp;
    last_ = frame->stamp;
    latest_ = now;
  }
  [[nodiscard]] Instant next_due() const override { return stream_.next_due(); }
  [[nodiscard]] DeviceReport report(Instant now) const override {
    DeviceReport report = report_of(own_, now);
    const CameraIntrinsics& size = stream_.intrinsics();
    const hal::StreamCounters counters = stream_.counters();
    const double span_s = (last_ - first_).seconds();
    const double rate_hz = frames_ > 1 && span_s > 0 ? (frames_ - 1) / span_s : 0;
    if (report.state == DeviceState::kReady && frames_ == 0) {
      fall_silent(report, "no frame came", "Check the camera's cable and power.");
    } else if (report.state == DeviceState::kReady) {
      if (report.device.empty()) report.device.set("{} x {}", size.width, size.height);
      const auto what = report.detail;
      report.detail.set("{}{}{:.1f} frames a second, {} of {} lost", what.view(), what.empty() ? "" : "; ", rate_hz,
                        counters.lost, counters.frames);
    }
    add_number(report, "rate_hz", rate_hz);
    if (own_ == nullptr) {
      add_number(report, "frames", static_cast<double>(counters.frames));
      add_number(report, "frames_lost", static_cast<double>(counters.lost));
    }
    if (frames_ > 0) add_number(report, "latency_s", (latest_ - last_).seconds());
    return report;
  }

 private:
  virtual void look_at(const hal::Frame&) {}

  hal::FrameStream& stream_;
  const hal::ReportingDevice* own_;
  int frames_ = 0;
  Instant first_{}, last_{}, latest_{};
};

/// Reads a picture now and then, too.
class WatchedDepth final : public WatchedStream {
 public:
  WatchedDepth(hal::DepthCamera& camera, const hal::ReportingDevice* own)
      : WatchedStream(camera, own), camera_(camera) {}
  [[nodiscard]] DeviceReport report(Instant now) const override {
    DeviceReport report = WatchedStream::report(now);
    if (report.state == DeviceState::kReady && repeats_) {
      report.state = DeviceState::kUnsuitable;
      report.detail.set("repeats one picture, with new time stamps");
      report.remedy.set("{}", fault_row(Fault::kStreamFrozen).remedy);
    }
    return report;
  }

 private:
  void look_at(const hal::Frame& frame) override {
    constexpr int kEvery = 4;  // frames: two a second at least from a stream of 10 Hz
    if (looked_++ % kEvery != 0) return;
    const CameraIntrinsics& size = camera_.intrinsics();
    pixels_.resize(static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height));
    if (!camera_.read(frame, {pixels_.data(), size.width, size.height})) return;
    repeats_ = picture_.repeats(frame.sequence, pixels_);
  }

  hal::DepthCamera& camera_;
  std::vector<std::uint16_t> pixels_;
  hal::RepeatedPicture picture_;
  int looked_ = 0;
  bool repeats_ = false;
};

std::string_view safety_text(hal::ArmSafety safety) {
  switch (safety) {
    case hal::ArmSafety::kNormal:
      return "normal";
    case hal::ArmSafety::kReduced:
      return "reduced mode";
    case hal::ArmSafety::kProtectiveStop:
      return "in a protective stop";
    case hal::ArmSafety::kEmergencyStop:
      return "in an emergency stop";
    case hal::ArmSafety::kRecovery:
      return "in recovery mode";
    case hal::ArmSafety::kFault:
      return "in a fault";
  }
  return "";
}

class WatchedArm final : public WatchedDevice {
 public:
  WatchedArm(hal::RobotArm& arm, const hal::ReportingDevice* own) : arm_(arm), own_(own) {}
  void poll(Instant now) override {
    while (const auto state = arm_.poll(now)) {
      if (states_++ == 0) first_ = state->stamp;
      last_ = *state;
    }
  }
  [[nodiscard]] Instant next_due() const override { return arm_.next_due(); }
  [[nodiscard]] DeviceReport report(Instant now) const override {
    DeviceReport report = report_of(own_, now);
    const double span_s = (last_.stamp - first_).seconds();
    const double rate_hz = states_ > 1 && span_s > 0 ? (states_ - 1) / span_s : 0;
    if (report.device.empty()) report.device.set("{}", arm_.model());
    if (report.state == DeviceState::kReady && states_ == 0) {
      fall_silent(report, "no report of its joints came", "Check the network cable and that the controller is on.");
    } else if (report.state == DeviceState::kReady) {
      const auto told = report.detail;
      report.detail.set("{}{}{:.1f} reports a second, {}", told.view(), told.empty() ? "" : "; ", rate_hz,
                        safety_text(last_.safety));
      if (last_.safety != hal::ArmSafety::kNormal && last_.safety != hal::ArmSafety::kReduced) {
        report.state = DeviceState::kUnsuitable;
        report.remedy.set("Find the cause, and clear it at the pendant.");
      }
    }
    add_number(report, "rate_hz", rate_hz);
    add_number(report, "reports", states_);
    return report;
  }

 private:
  hal::RobotArm& arm_;
  const hal::ReportingDevice* own_;
  int states_ = 0;
  Instant first_{};
  hal::ArmState last_;
};

/// Pendant or panel.
template <typename Device>
class WatchedOperatorDevice final : public WatchedDevice {
 public:
  WatchedOperatorDevice(Device& device, const hal::ReportingDevice* own) : device_(device), own_(own) {}
  void poll(Instant now) override {
    while (device_.poll(now)) ++keys_;
  }
  [[nodiscard]] Instant next_due() const override { return device_.next_due(); }
  [[nodiscard]] DeviceReport report(Instant now) const override {
    DeviceReport report = report_of(own_, now);
    if (own_ == nullptr) report.detail.set("answers");
    add_number(report, "keys_pressed", keys_);
    return report;
  }

 private:
  Device& device_;
  const hal::ReportingDevice* own_;
  int keys_ = 0;
};

class AbsentDevice final : public WatchedDevice {
 public:
  AbsentDevice(std::string_view device, const Error& error) {
    report_.state = DeviceState::kMissing;
    report_.device.set("{}", device);
    report_.detail.set("{}", error.detail());
    const bool no_room = error.fault == Fault::kOutOfMemory;
    report_.remedy.set("{}", no_room
                                 ? "32 frames are held: choose a smaller picture, or a format with fewer bytes a pixel."
                                 : fault_row(error.fault).remedy);
  }
  void poll(Instant) override {}
  [[nodiscard]] Instant next_due() const override { return {INT64_MAX / 2}; }
  [[nodiscard]] DeviceReport report(Instant) const override { return report_; }

 private:
  DeviceReport report_;
};

}  // namespace

std::unique_ptr<WatchedDevice> watch_stream(hal::FrameStream& stream, const hal::ReportingDevice* own) {
  return std::make_unique<WatchedStream>(stream, own);
}
std::unique_ptr<WatchedDevice> watch_depth(hal::DepthCamera& camera, const hal::ReportingDevice* own) {
  return std::make_unique<WatchedDepth>(camera, own);
}
std::unique_ptr<WatchedDevice> watch_arm(hal::RobotArm& arm, const hal::ReportingDevice* own) {
  return std::make_unique<WatchedArm>(arm, own);
}
std::unique_ptr<WatchedDevice> watch_pendant(hal::Pendant& pendant, const hal::ReportingDevice* own) {
  return std::make_unique<WatchedOperatorDevice<hal::Pendant>>(pendant, own);
}
std::unique_ptr<WatchedDevice> watch_panel(hal::Panel& panel, const hal::ReportingDevice* own) {
  return std::make_unique<WatchedOperatorDevice<hal::Panel>>(panel, own);
}
std::unique_ptr<WatchedDevice> absent_device(std::string_view device, const Error& error) {
  return std::make_unique<AbsentDevice>(device, error);
}

bool CheckResult::all_ready() const {
  return std::ranges::all_of(devices, [](const CheckedDevice& d) { return d.report.state == DeviceState::kReady; });
}

std::vector<CheckedDevice> watch_devices(std::span<const DeviceCheck> checks, Clock& clock) {
  const Instant begin = clock.now();
  std::vector<double> ready_since_s(checks.size(), -1);
  for (;;) {
    const Instant now = clock.now();
    const double passed_s = (now - begin).seconds();
    Instant next = now + milliseconds(100);
    bool done = true;
    for (std::size_t i = 0; i < checks.size(); ++i) {
      WatchedDevice& device = *checks[i].device;
      if (device.next_due() <= now) device.poll(now);
      const bool ready = device.report(now).state == DeviceState::kReady;
      if (!ready) ready_since_s[i] = -1;
      if (ready && ready_since_s[i] < 0) ready_since_s[i] = passed_s;
      done = done && ready && passed_s - ready_since_s[i] >= kWatched_s;
      next = std::min(next, device.next_due());
    }
    if (done || passed_s >= kPatience_s) break;
    clock.sleep_until(std::max(next, now + kLeastStep));
  }
  std::vector<CheckedDevice> found;
  for (const DeviceCheck& check : checks)
    found.push_back({check.role, check.simulated, check.device->report(clock.now())});
  return found;
}

}  // namespace firstlook
