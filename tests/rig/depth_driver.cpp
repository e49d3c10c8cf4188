/// A driver of OpenNI 2 with one depth sensor that shows what another process wrote into a DepthWindow.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <thread>

#include "tests/rig/depth_window.hpp"
#include "tests/support/openni_driver/depth_stream.hpp"

namespace firstlook::rig {
namespace {

constexpr int kRate_hz = 30;
OniVideoMode g_mode{ONI_PIXEL_FORMAT_DEPTH_1_MM, kDepthWidth, kDepthHeight, kRate_hz};
OniSensorInfo g_sensor{ONI_SENSOR_DEPTH, 1, &g_mode};

/// Null while nobody has made one.
const DepthWindow* open_window() {
  const int file = open(kDepthWindowPath, O_RDONLY | O_CLOEXEC);
  if (file < 0) return nullptr;
  void* const bytes = mmap(nullptr, sizeof(DepthWindow), PROT_READ, MAP_SHARED, file, 0);
  close(file);
  return bytes == MAP_FAILED ? nullptr : static_cast<const DepthWindow*>(bytes);
}

class WindowStream final : public test::DepthStreamBase {
 public:
  explicit WindowStream(const DepthWindow& window)
      : DepthStreamBase(g_mode, window.horizontal_fov_rad, window.vertical_fov_rad), window_(window) {}
  ~WindowStream() override { stop(); }
  OniStatus setProperty(int property, const void*, int) override {
    const bool known = property == ONI_STREAM_PROPERTY_VIDEO_MODE || property == ONI_STREAM_PROPERTY_MIRRORING;
    return known ? ONI_STATUS_OK : ONI_STATUS_NOT_SUPPORTED;
  }

 private:
  void deliver() override {
    std::uint32_t seen = window_.frame;
    while (runs()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
      if (window_.frame == seen) continue;
      OniFrame* const frame = getServices().acquireFrame();
      if (frame == nullptr) continue;
      const std::uint32_t before = window_.turn.load(std::memory_order_acquire);
      std::memcpy(frame->data, window_.depth_mm, sizeof window_.depth_mm);
      frame->frameIndex = static_cast<int>(window_.frame);
      frame->timestamp = window_.stamp_us;
      std::atomic_thread_fence(std::memory_order_acquire);
      if (before % 2 == 0 && window_.turn.load(std::memory_order_relaxed) == before) {
        seen = static_cast<std::uint32_t>(frame->frameIndex);
        raise(frame);
      }
      getServices().releaseFrame(frame);
    }
  }

  const DepthWindow& window_;
};

class WindowDevice final : public oni::driver::DeviceBase {
 public:
  explicit WindowDevice(const DepthWindow& window) : window_(window) {}
  OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override {
    *sensors = &g_sensor;
    *count = 1;
    return ONI_STATUS_OK;
  }
  oni::driver::StreamBase* createStream(OniSensorType type) override {
    return type == ONI_SENSOR_DEPTH ? new WindowStream(window_) : nullptr;
  }
  void destroyStream(oni::driver::StreamBase* stream) override { delete stream; }

 private:
  const DepthWindow& window_;
};

class WindowDriver final : public oni::driver::DriverBase {
 public:
  explicit WindowDriver(OniDriverServices* services) : DriverBase(services) {
    std::strcpy(info_.uri, "rig://depth");
    std::strcpy(info_.vendor, "firstlook");
    std::strcpy(info_.name, "rig depth");
  }
  OniStatus initialize(oni::driver::DeviceConnectedCallback connected,
                       oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback changed, void* cookie) override {
    DriverBase::initialize(connected, disconnected, changed, cookie);
    window_ = open_window();
    if (window_ != nullptr) deviceConnected(&info_);
    return ONI_STATUS_OK;
  }
  oni::driver::DeviceBase* deviceOpen(const char*, const char*) override {
    return window_ == nullptr ? nullptr : new WindowDevice(*window_);
  }
  void deviceClose(oni::driver::DeviceBase* device) override { delete device; }
  void shutdown() override {}

 private:
  OniDeviceInfo info_{};
  const DepthWindow* window_ = nullptr;
};

}  // namespace
}  // namespace firstlook::rig

ONI_EXPORT_DRIVER(firstlook::rig::WindowDriver)
