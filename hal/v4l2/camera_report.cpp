/// What the camera says of itself, and what to do when it does not work.
#include <cstring>

#include "hal/v4l2/v4l2_camera.hpp"

namespace firstlook::v4l2 {
namespace {

using hal::DeviceState;

void tell_trouble(const Capture& capture, const CaptureOptions& asked, hal::DeviceReport& report) {
  const Granted& granted = capture.granted();
  switch (capture.trouble()) {
    case CaptureTrouble::kNone:
      report.detail.set("is not open");
      break;
    case CaptureTrouble::kAbsent:
      report.detail.set("there is no such device");
      report.remedy.set(
          "Plug in the camera; `ls -l /dev/v4l/by-id` shows those that are there: camera.device names one.");
      break;
    case CaptureTrouble::kForbidden:
      report.detail.set("the program may not open it");
      report.remedy.set("Put the program's user into the group video, and log in again.");
      break;
    case CaptureTrouble::kBusy:
      report.detail.set("another program uses it");
      report.remedy.set("End the other program; `fuser -v {}` names it.", asked.device);
      break;
    case CaptureTrouble::kNoCapture:
      report.detail.set("it is no device that streams video ({})",
                        granted.driver.empty() ? "no V4L2" : granted.driver.view());
      report.remedy.set(
          "Many cameras show two devices, one for their metadata: name the other, which ends in index0, in "
          "camera.device.");
      break;
    case CaptureTrouble::kFormat: {
      const auto fourcc = fourcc_text(granted.fourcc);
      report.detail.set("asked for {} x {}, it grants {} x {} in {}", asked.width, asked.height, granted.layout.width,
                        granted.layout.height, fourcc.data());
      report.remedy.set(
          "`v4l2-ctl -d {} --list-formats-ext` lists what it can: correct camera.width, camera.height or "
          "camera.format.",
          asked.device);
      break;
    }
    case CaptureTrouble::kMemory:
      report.detail.set("it grants fewer than two buffers");
      report.remedy.set("Unplug it and plug it in again; another USB port may help.");
      break;
    case CaptureTrouble::kFailed:
      report.detail.set("{}: {}", capture.failed_call(), std::strerror(capture.last_error()));
      report.remedy.set("Unplug it and plug it in again, at another USB port and without a hub.");
      break;
  }
}

}  // namespace

void V4l2Camera::tell_silence(hal::DeviceReport& report) const {
  report.state = worked_ ? DeviceState::kLost : DeviceState::kMissing;
  report.detail.set("no frame came for {:.1f} s", options_.stall.seconds());
  report.remedy.set("Check the camera's cable and power; too many cameras on one USB controller do this, too.");
}

hal::DeviceReport V4l2Camera::report(Instant now) const {
  hal::DeviceReport report;
  report.device.set("{}", options_.capture.device);
  const CaptureTrouble trouble = capture_.trouble();
  if (capture_.is_open()) {
    const Granted& granted = capture_.granted();
    const auto fourcc = fourcc_text(granted.fourcc);
    const bool flows = stream_.frames > stream_.lost && now - last_frame_ <= options_.stall;
    report.detail.set(
        "{} ({}), {} x {} {}{}{}{}", granted.card.view(), granted.driver.view(), granted.layout.width,
        granted.layout.height, fourcc.data(), granted.notes.empty() ? "" : "; ", granted.notes.view(),
        counters_.stamps_unusable > 0 ? "; its time stamps are of no known clock: the arrival counts" : "");
    report.state = DeviceState::kReady;
    if (!flows || silent_) {
      report.state = DeviceState::kStarting;
      if (silent_) tell_silence(report);
    }
  } else if (layout_changed_) {
    report.state = DeviceState::kUnsuitable;
    report.detail.set("another camera, or another format, came back in its place");
    report.remedy.set("Plug the camera of before into its place, or restart firstlook.");
  } else if (trouble == CaptureTrouble::kFormat || trouble == CaptureTrouble::kNoCapture ||
             trouble == CaptureTrouble::kMemory) {
    report.state = DeviceState::kUnsuitable;
    tell_trouble(capture_, options_.capture, report);
  } else if (silent_ && trouble == CaptureTrouble::kNone) {
    tell_silence(report);
  } else if (trouble == CaptureTrouble::kNone && counters_.input_errors == 0) {
    report.state = DeviceState::kStarting;
    report.detail.set("was not opened yet");
  } else {
    report.state = worked_ ? DeviceState::kLost : DeviceState::kMissing;
    tell_trouble(capture_, options_.capture, report);
  }
  const auto count = [&](std::string_view name, std::uint64_t value) { report.add(name, static_cast<double>(value)); };
  count("frames", stream_.frames);
  count("frames_lost", stream_.lost);
  count("broken", counters_.broken);
  count("gaps", counters_.gaps);
  count("input_errors", counters_.input_errors);
  count("stalls", counters_.stalls);
  count("disconnects", counters_.disconnects);
  count("stamps_late", counters_.stamps_late);
  count("stamps_unusable", counters_.stamps_unusable);
  count("slots_busy", counters_.slots_busy);
  report.add("asked_rate_hz", capture_.granted().rate_hz);
  return report;
}

}  // namespace firstlook::v4l2
