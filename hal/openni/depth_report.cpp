/// What the depth camera says of itself, and what to do when it does not work.
#include "hal/openni/openni_depth.hpp"

namespace firstlook::openni {
namespace {

void tell_trouble(SensorTrouble trouble, std::string_view words, const SensorOptions& asked,
                  hal::DeviceReport& report) {
  switch (trouble) {
    case SensorTrouble::kNone:
      break;
    case SensorTrouble::kLibrary:
      report.detail.set("OpenNI does not start: {}", words);
      report.remedy.set("Install libopenni2-0 again.");
      break;
    case SensorTrouble::kNoDevice:
      report.detail.set("OpenNI finds no device");
      report.remedy.set(
          "Plug in the sensor (lsusb shows 1d27:...), and check that the program may use it (udev rules). A Kinect is "
          "none "
          "of OpenNI's.");
      break;
    case SensorTrouble::kNotOpen:
      report.detail.set("cannot be opened: {}", words.empty() ? "it was disconnected" : words);
      report.remedy.set("Check depth.device, the sensor's cable, and that no other program uses it.");
      break;
    case SensorTrouble::kNoDepth:
      report.detail.set("it has no depth stream");
      report.remedy.set("Name a depth sensor, or a recording with depth, in depth.device.");
      break;
    case SensorTrouble::kNoMode:
      report.detail.set("it has no depth of {} x {}, but {}", asked.width, asked.height, words);
      report.remedy.set("Use a sensor or a recording of that size.");
      break;
    case SensorTrouble::kNotStarted:
      report.detail.set("its stream does not start: {}", words);
      report.remedy.set("Unplug it and plug it in again, at another USB port.");
      break;
  }
}

}  // namespace

hal::DeviceReport OpenNiDepth::report(Instant) const {
  using hal::DeviceState;
  const std::scoped_lock lock(mutex_);
  const SensorInfo& info = shared_.info;
  hal::DeviceReport report;
  report.device.set("{}", !options_.sensor.uri.empty() ? std::string_view(options_.sensor.uri)
                          : info.uri.empty()           ? std::string_view("OpenNI")
                                                       : info.uri.view());
  const DeviceState gone = shared_.worked ? DeviceState::kLost : DeviceState::kMissing;
  switch (shared_.phase) {
    case Phase::kStarting:
      report.state = DeviceState::kStarting;
      report.detail.set("is being opened");
      break;
    case Phase::kStreaming:
      report.state = shared_.worked ? DeviceState::kReady : DeviceState::kStarting;
      report.detail.set("{}, {} x {}, {} units a metre{}{}", info.name.view(), options_.sensor.width,
                        options_.sensor.height, info.units_per_m, info.mirrored ? ", mirrored back" : "",
                        info.is_file ? ", a recording" : "");
      if (info.registered) {
        report.state = DeviceState::kUnsuitable;
        report.remedy.set("Its depth is warped to its colour camera and it does not let us change that: use another.");
      } else if (taken_up_ && intrinsics_.fx == 0) {
        report.state = DeviceState::kUnsuitable;
        report.remedy.set("It does not tell its field of view: give a camera_info.yaml in depth.info.");
      }
      break;
    case Phase::kSilent:
      report.state = gone;
      report.detail.set("no frame came for {:.1f} s", options_.stall.seconds());
      report.remedy.set("Unplug it and plug it in again, at a USB 2 port of its own; check its power supply.");
      break;
    case Phase::kEnded:
      report.state = DeviceState::kLost;
      report.detail.set("the recording has ended");
      report.remedy.set("Name a longer one in depth.device, or a device.");
      break;
    case Phase::kFailed: {
      const bool other = shared_.trouble == SensorTrouble::kNoMode || shared_.trouble == SensorTrouble::kNoDepth;
      report.state = other ? DeviceState::kUnsuitable : gone;
      tell_trouble(shared_.trouble, shared_.words, options_.sensor, report);
      break;
    }
  }
  const auto count = [&](std::string_view name, std::uint64_t value) { report.add(name, static_cast<double>(value)); };
  count("frames", shared_.stream.frames);
  count("frames_lost", shared_.stream.lost);
  count("opens", shared_.counters.opens);
  count("stalls", shared_.counters.stalls);
  count("disconnects", shared_.counters.disconnects);
  count("other_size", shared_.counters.other_size);
  count("slots_busy", shared_.counters.slots_busy);
  count("resets", shared_.counters.resets);
  count("stamps_late", shared_.counters.stamps_late);
  return report;
}

}  // namespace firstlook::openni
