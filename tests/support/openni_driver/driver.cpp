/// A driver of OpenNI 2 with one virtual depth sensor: 64 x 48, 30 frames a second.
#include <chrono>
#include <cstring>
#include <thread>

#include "tests/support/openni_driver/depth_stream.hpp"
#include "tests/support/openni_driver/test_depth.hpp"

extern "C" {
__attribute__((visibility("default"))) firstlook::test::TestDepth firstlook_test_depth;
}

namespace {

using firstlook::test::give;
using firstlook::test::kTestDepthHeight;
using firstlook::test::kTestDepthWidth;
using firstlook::test::test_depth_mm;

constexpr int kRate_hz = 30;
OniVideoMode g_mode{ONI_PIXEL_FORMAT_DEPTH_1_MM, kTestDepthWidth, kTestDepthHeight, kRate_hz};
OniSensorInfo g_sensor{ONI_SENSOR_DEPTH, 1, &g_mode};

class DepthStream final : public firstlook::test::DepthStreamBase {
 public:
  DepthStream()
      : DepthStreamBase(g_mode, static_cast<float>(firstlook::test::kTestHorizontalFov_rad),
                        static_cast<float>(firstlook::test::kTestVerticalFov_rad)) {}
  ~DepthStream() override { stop(); }
  OniStatus setProperty(int property, const void* data, int size) override {
    if (property == ONI_STREAM_PROPERTY_MIRRORING && size == sizeof(OniBool)) {
      OniBool on = FALSE;
      std::memcpy(&on, data, sizeof on);
      mirrored_ = on != FALSE;
      return ONI_STATUS_OK;  // also when it stays as it is: so do some devices
    }
    return property == ONI_STREAM_PROPERTY_VIDEO_MODE ? ONI_STATUS_OK : ONI_STATUS_NOT_SUPPORTED;
  }

 private:
  [[nodiscard]] bool mirrored() const override { return mirrored_ || firstlook_test_depth.always_mirrored; }

  void deliver() override {
    const auto begin = std::chrono::steady_clock::now();
    for (int index = 1; runs(); ++index) {
      std::this_thread::sleep_until(begin + std::chrono::microseconds(1'000'000LL * index / kRate_hz));
      if (firstlook_test_depth.stalled) continue;
      if (firstlook_test_depth.skip > 0) {
        --firstlook_test_depth.skip;
        continue;
      }
      OniFrame* const frame = getServices().acquireFrame();
      if (frame == nullptr) continue;
      frame->frameIndex = index;
      frame->timestamp = 5'000'000'000ULL + 1'000'000ULL * static_cast<unsigned>(index) / kRate_hz;
      auto* pixel = static_cast<std::uint16_t*>(frame->data);
      for (int y = 0; y < kTestDepthHeight; ++y) {
        for (int x = 0; x < kTestDepthWidth; ++x) {
          *pixel++ = test_depth_mm(static_cast<std::uint32_t>(index), mirrored() ? kTestDepthWidth - 1 - x : x, y);
        }
      }
      raise(frame);
      getServices().releaseFrame(frame);
      ++firstlook_test_depth.frames;
    }
  }

  std::atomic<bool> mirrored_{true};  // as PrimeSense's are at first
};

class DepthDevice final : public oni::driver::DeviceBase {
 public:
  OniStatus getSensorInfoList(OniSensorInfo** sensors, int* count) override {
    *sensors = &g_sensor;
    *count = 1;
    return ONI_STATUS_OK;
  }
  oni::driver::StreamBase* createStream(OniSensorType type) override {
    return type == ONI_SENSOR_DEPTH ? new DepthStream : nullptr;
  }
  void destroyStream(oni::driver::StreamBase* stream) override { delete stream; }
  OniBool isPropertySupported(int property) override { return property == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION; }
  OniStatus getProperty(int property, void* data, int* size) override {
    if (property != ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION) return ONI_STATUS_NOT_SUPPORTED;
    const bool on = registered_ || firstlook_test_depth.always_registered;
    return give(on ? ONI_IMAGE_REGISTRATION_DEPTH_TO_COLOR : ONI_IMAGE_REGISTRATION_OFF, data, size);
  }
  OniStatus setProperty(int property, const void* data, int size) override {
    OniImageRegistrationMode mode{};
    if (property != ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION || size != sizeof mode) return ONI_STATUS_NOT_SUPPORTED;
    std::memcpy(&mode, data, sizeof mode);
    registered_ = mode != ONI_IMAGE_REGISTRATION_OFF;
    return ONI_STATUS_OK;
  }

 private:
  bool registered_ = true;
};

class DepthDriver;
DepthDriver* g_driver = nullptr;

class DepthDriver final : public oni::driver::DriverBase {
 public:
  explicit DepthDriver(OniDriverServices* services) : DriverBase(services) {
    std::strcpy(info_.uri, firstlook::test::kTestDepthUri);
    std::strcpy(info_.vendor, "firstlook");
    std::strcpy(info_.name, "test depth");
    g_driver = this;
    firstlook_test_depth.unplug = [] {
      firstlook_test_depth.present = false;
      g_driver->deviceDisconnected(&g_driver->info_);
    };
    firstlook_test_depth.plug = [] {
      firstlook_test_depth.present = true;
      g_driver->deviceConnected(&g_driver->info_);
    };
  }
  OniStatus initialize(oni::driver::DeviceConnectedCallback connected,
                       oni::driver::DeviceDisconnectedCallback disconnected,
                       oni::driver::DeviceStateChangedCallback changed, void* cookie) override {
    DriverBase::initialize(connected, disconnected, changed, cookie);
    deviceConnected(&info_);
    return ONI_STATUS_OK;
  }
  oni::driver::DeviceBase* deviceOpen(const char*, const char*) override {
    return firstlook_test_depth.present ? new DepthDevice : nullptr;
  }
  void deviceClose(oni::driver::DeviceBase* device) override { delete device; }
  void shutdown() override {}

 private:
  OniDeviceInfo info_{};
};

}  // namespace

ONI_EXPORT_DRIVER(DepthDriver)
