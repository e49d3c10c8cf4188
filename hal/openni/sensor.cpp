#include "hal/openni/sensor.hpp"

#include <OpenNI.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

namespace firstlook::openni {
namespace {

using ::openni::Device;
using ::openni::OpenNI;
using ::openni::VideoFrameRef;
using ::openni::VideoMode;
using ::openni::VideoStream;

constexpr bool ok(::openni::Status status) { return status == ::openni::STATUS_OK; }

/// Starts the library once.
bool library_started() {
  static const bool started = ok(OpenNI::initialize());
  return started;
}

/// Told by threads of the library.
class Unplugging final : public OpenNI::DeviceDisconnectedListener {
 public:
  void watch(const char* uri) {
    uri_ = FixedText<ONI_MAX_STR>(uri);
    gone_ = false;
  }
  [[nodiscard]] bool gone() const { return gone_; }
  void onDeviceDisconnected(const ::openni::DeviceInfo* device) override {
    if (device != nullptr && uri_.view() == device->getUri()) gone_ = true;
  }

 private:
  FixedText<ONI_MAX_STR> uri_;
  std::atomic<bool> gone_ = false;
};

double units_of(const VideoMode& mode) {
  return mode.getPixelFormat() == ::openni::PIXEL_FORMAT_DEPTH_100_UM ? 10000 : 1000;
}

bool is_depth(const VideoMode& mode) {
  return mode.getPixelFormat() == ::openni::PIXEL_FORMAT_DEPTH_1_MM ||
         mode.getPixelFormat() == ::openni::PIXEL_FORMAT_DEPTH_100_UM;
}

}  // namespace

struct Sensor::Library {
  Device device;
  VideoStream depth;
  VideoFrameRef frame;
  Unplugging unplugging;
  bool listens = false;
};

Sensor::Sensor() : library_(std::make_unique<Library>()) {}
Sensor::~Sensor() { close(); }

SensorTrouble Sensor::fail(SensorTrouble trouble) {
  std::string_view words = OpenNI::getExtendedError();
  words = words.substr(0, words.find_last_not_of(" \t\n") + 1);
  words = words.substr(std::min(words.size(), words.find_first_not_of(" \t\n")));
  if (words_.empty()) words_.set("{}", words.substr(0, words.find('\n')));
  close();
  return trouble;
}

SensorTrouble Sensor::open(const SensorOptions& options) {
  close();
  info_ = {};
  words_.clear();
  if (!library_started()) return fail(SensorTrouble::kLibrary);
  if (options.uri.empty()) {
    ::openni::Array<::openni::DeviceInfo> devices;
    OpenNI::enumerateDevices(&devices);
    if (devices.getSize() == 0) return fail(SensorTrouble::kNoDevice);
  }
  if (!ok(library_->device.open(options.uri.empty() ? ::openni::ANY_DEVICE : options.uri.c_str()))) {
    return fail(SensorTrouble::kNotOpen);
  }
  const ::openni::DeviceInfo& device = library_->device.getDeviceInfo();
  info_.name.set("{} {}", device.getVendor(), device.getName());
  info_.uri.set("{}", device.getUri());
  info_.is_file = library_->device.isFile();
  if (!library_->device.hasSensor(::openni::SENSOR_DEPTH) ||
      !ok(library_->depth.create(library_->device, ::openni::SENSOR_DEPTH))) {
    return fail(SensorTrouble::kNoDepth);
  }
  if (!choose_mode(options)) return fail(SensorTrouble::kNoMode);
  hold_still();
  library_->unplugging.watch(device.getUri());
  library_->listens = ok(OpenNI::addDeviceDisconnectedListener(&library_->unplugging));
  if (!ok(library_->depth.start())) return fail(SensorTrouble::kNotStarted);
  return SensorTrouble::kNone;
}

/// Millimetres before tenths of them, and the rate that is nearest to the one asked for. A recording has the mode that
/// it has.
bool Sensor::choose_mode(const SensorOptions& options) {
  VideoStream& depth = library_->depth;
  const auto fits = [&](const VideoMode& mode) {
    return is_depth(mode) && mode.getResolutionX() == options.width && mode.getResolutionY() == options.height;
  };
  const auto& modes = depth.getSensorInfo().getSupportedVideoModes();
  const VideoMode* best = nullptr;
  const auto cost = [&](const VideoMode& mode) {
    return std::abs(mode.getFps() - options.rate_hz) * 2 + (units_of(mode) == 1000 ? 0 : 1);
  };
  for (int i = 0; i < modes.getSize(); ++i) {
    if (fits(modes[i]) && (best == nullptr || cost(modes[i]) < cost(*best))) best = &modes[i];
  }
  if (best != nullptr && !info_.is_file && !ok(depth.setVideoMode(*best))) return false;
  const VideoMode mode = depth.getVideoMode();
  if (!fits(mode)) {
    words_.set("{} x {}", mode.getResolutionX(), mode.getResolutionY());
    return false;
  }
  info_.units_per_m = units_of(mode);
  info_.rate_hz = mode.getFps();
  return true;
}

/// Depth as the depth camera sees it: neither mirrored nor warped to the colour camera. What the library says of its
/// success cannot be believed (registration of a recording is "not supported", set with OK and then read as on), so
/// what can be read back counts.
void Sensor::hold_still() {
  VideoStream& depth = library_->depth;
  (void)depth.setMirroringEnabled(false);
  info_.mirrored = depth.getMirroringEnabled();
  if (!info_.is_file) {
    (void)library_->device.setImageRegistrationMode(::openni::IMAGE_REGISTRATION_OFF);
    info_.registered = library_->device.getImageRegistrationMode() != ::openni::IMAGE_REGISTRATION_OFF;
    (void)depth.resetCropping();
  } else if (::openni::PlaybackControl* playback = library_->device.getPlaybackControl(); playback != nullptr) {
    (void)playback->setRepeatEnabled(false);
    (void)playback->setSpeed(1);
  }
  info_.horizontal_fov_rad = depth.getHorizontalFieldOfView();
  info_.vertical_fov_rad = depth.getVerticalFieldOfView();
}

/// Debian's player of recordings (2.2.0.33) has a thread that goes on reading while its device is closed, and then
/// crashes: one time in ten. A recording is told to wait ("on demand") and stays open as long as the program.
void Sensor::keep_open() {
  static auto* const recordings = new std::vector<std::unique_ptr<Library>>;  // not closed at the end, either
  if (::openni::PlaybackControl* playback = library_->device.getPlaybackControl(); playback != nullptr)
    (void)playback->setSpeed(-1);
  recordings->push_back(std::move(library_));
  library_ = std::make_unique<Library>();
}

void Sensor::close() {
  library_->frame.release();
  if (library_->listens) OpenNI::removeDeviceDisconnectedListener(&library_->unplugging);
  library_->listens = false;
  if (library_->device.isValid() && library_->device.isFile()) {
    keep_open();
    return;
  }
  if (library_->depth.isValid()) {
    library_->depth.stop();
    library_->depth.destroy();
  }
  if (library_->device.isValid()) library_->device.close();
}

Sensor::Waited Sensor::wait(int timeout_ms, SensorFrame& frame) {
  // A driver may go on delivering after it reported that its device went away.
  if (!library_->depth.isValid() || library_->unplugging.gone()) return Waited::kFailed;
  library_->frame.release();
  VideoStream* streams[] = {&library_->depth};
  int ready = -1;
  const ::openni::Status status = OpenNI::waitForAnyStream(streams, 1, &ready, timeout_ms);
  if (status == ::openni::STATUS_TIME_OUT) return Waited::kNothing;
  if (!ok(status) || !ok(library_->depth.readFrame(&library_->frame)) || !library_->frame.isValid()) {
    return Waited::kFailed;
  }
  const VideoFrameRef& read = library_->frame;
  frame.rows = static_cast<const std::uint8_t*>(read.getData());
  frame.stride = read.getStrideInBytes();
  frame.width = read.getWidth();
  frame.height = read.getHeight();
  frame.index = static_cast<std::uint32_t>(read.getFrameIndex());
  frame.device_us = static_cast<std::int64_t>(read.getTimestamp());
  return Waited::kFrame;
}

}  // namespace firstlook::openni
