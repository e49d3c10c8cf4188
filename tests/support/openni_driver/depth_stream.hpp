/// What the OpenNI 2 drivers of tests and rig share: a depth stream with a thread that delivers its frames.
#pragma once

#ifndef XN_NEW  // OniDriverAPI.h allocates with these
#define XN_NEW(type, ...) new type(__VA_ARGS__)
#define XN_DELETE(pointer) delete (pointer)
#endif
#include <Driver/OniDriverAPI.h>

#include <atomic>
#include <cstring>
#include <thread>

namespace firstlook::test {

/// Writes a property's value where OpenNI asks for it.
template <typename T>
OniStatus give(const T& value, void* data, int* size) {
  if (*size < static_cast<int>(sizeof value)) return ONI_STATUS_BAD_PARAMETER;
  std::memcpy(data, &value, sizeof value);
  *size = sizeof value;
  return ONI_STATUS_OK;
}

/// Derived classes deliver frames while runs(), and stop() in their destructor.
class DepthStreamBase : public oni::driver::StreamBase {
 public:
  DepthStreamBase(const OniVideoMode& mode, float horizontal_fov_rad, float vertical_fov_rad)
      : mode_(mode), horizontal_fov_rad_(horizontal_fov_rad), vertical_fov_rad_(vertical_fov_rad) {}
  OniStatus start() override {
    runs_ = true;
    thread_ = std::thread([this] { deliver(); });
    return ONI_STATUS_OK;
  }
  void stop() override {
    runs_ = false;
    if (thread_.joinable()) thread_.join();
  }
  OniBool isPropertySupported(int property) override {
    // Without cropping a recording of this stream plays no frames.
    return property == ONI_STREAM_PROPERTY_CROPPING || property == ONI_STREAM_PROPERTY_VIDEO_MODE ||
           property == ONI_STREAM_PROPERTY_HORIZONTAL_FOV || property == ONI_STREAM_PROPERTY_VERTICAL_FOV ||
           property == ONI_STREAM_PROPERTY_MAX_VALUE || property == ONI_STREAM_PROPERTY_MIRRORING;
  }
  OniStatus getProperty(int property, void* data, int* size) override {
    switch (property) {
      case ONI_STREAM_PROPERTY_CROPPING:
        return give(OniCropping{}, data, size);
      case ONI_STREAM_PROPERTY_VIDEO_MODE:
        return give(mode_, data, size);
      case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
        return give(horizontal_fov_rad_, data, size);
      case ONI_STREAM_PROPERTY_VERTICAL_FOV:
        return give(vertical_fov_rad_, data, size);
      case ONI_STREAM_PROPERTY_MAX_VALUE:
        return give(10000, data, size);
      case ONI_STREAM_PROPERTY_MIRRORING:
        return give(OniBool{mirrored() ? TRUE : FALSE}, data, size);
      default:
        return ONI_STATUS_NOT_SUPPORTED;
    }
  }

 protected:
  [[nodiscard]] bool runs() const { return runs_; }
  [[nodiscard]] virtual bool mirrored() const { return false; }
  /// On the stream's own thread.
  virtual void deliver() = 0;
  /// Everything of a frame but its number, its time and its pixels; then OpenNI has it.
  void raise(OniFrame* frame) {
    frame->sensorType = ONI_SENSOR_DEPTH;
    frame->videoMode = mode_;
    frame->width = mode_.resolutionX;
    frame->height = mode_.resolutionY;
    frame->stride = mode_.resolutionX * 2;
    frame->croppingEnabled = FALSE;
    frame->dataSize = frame->stride * frame->height;
    raiseNewFrame(frame);
  }

 private:
  OniVideoMode mode_;
  float horizontal_fov_rad_, vertical_fov_rad_;
  std::thread thread_;
  std::atomic<bool> runs_{false};
};

}  // namespace firstlook::test
