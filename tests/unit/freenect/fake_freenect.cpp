#include "tests/unit/freenect/fake_freenect.hpp"

#include <libfreenect.h>

#include <chrono>
#include <thread>
#include <vector>

struct _freenect_context {
  int unused;
};
struct _freenect_device {
  void* user = nullptr;
  freenect_depth_cb depth = nullptr;
  freenect_video_cb video = nullptr;
  bool depth_on = false, video_on = false;
  unsigned frames = 0;
  std::chrono::steady_clock::time_point begin;
};

namespace firstlook::test {
FakeKinect& fake_kinect() {
  static FakeKinect kinect;
  return kinect;
}
}  // namespace firstlook::test

namespace {
using firstlook::test::fake_kinect;
_freenect_context g_context;
_freenect_device g_device;
std::vector<std::uint16_t> g_depth(640 * 480);
std::vector<std::uint8_t> g_video(2 * 640 * 480);
constexpr unsigned kTicksPerFrame = 2'000'000;

freenect_frame_mode mode_of(int format) {
  freenect_frame_mode mode{};
  mode.bytes = 2 * 640 * 480;
  mode.width = 640;
  mode.height = 480;
  mode.dummy = format;
  mode.is_valid = 1;
  return mode;
}
}  // namespace

extern "C" {
int freenect_init(freenect_context** context, freenect_usb_context*) {
  if (!fake_kinect().usb) return -1;
  *context = &g_context;
  return 0;
}
int freenect_shutdown(freenect_context*) { return 0; }
void freenect_set_log_level(freenect_context*, freenect_loglevel) {}
void freenect_set_log_callback(freenect_context*, freenect_log_cb) {}
int freenect_num_devices(freenect_context*) { return fake_kinect().present ? 1 : 0; }
void freenect_select_subdevices(freenect_context*, freenect_device_flags) {}
int freenect_open_device(freenect_context*, freenect_device** device, int) {
  if (!fake_kinect().openable) return -1;
  g_device = {};
  g_device.begin = std::chrono::steady_clock::now();
  *device = &g_device;
  ++fake_kinect().opens;
  fake_kinect().is_open = true;
  return 0;
}
int freenect_open_device_by_camera_serial(freenect_context* context, freenect_device** device, const char* serial) {
  return std::string(serial) == "A00366" ? freenect_open_device(context, device, 0) : -1;
}
int freenect_close_device(freenect_device*) {
  fake_kinect().is_open = false;
  return 0;
}
void freenect_set_user(freenect_device* device, void* user) { device->user = user; }
void* freenect_get_user(freenect_device* device) { return device->user; }
void freenect_set_depth_callback(freenect_device* device, freenect_depth_cb callback) { device->depth = callback; }
void freenect_set_video_callback(freenect_device* device, freenect_video_cb callback) { device->video = callback; }
freenect_frame_mode freenect_find_depth_mode(freenect_resolution, freenect_depth_format format) {
  return mode_of(format);
}
freenect_frame_mode freenect_find_video_mode(freenect_resolution, freenect_video_format format) {
  return mode_of(format);
}
int freenect_set_depth_mode(freenect_device*, const freenect_frame_mode mode) {
  fake_kinect().depth_in_mm = mode.depth_format == FREENECT_DEPTH_MM;
  return 0;
}
int freenect_set_video_mode(freenect_device*, freenect_frame_mode mode) {
  return mode.video_format == FREENECT_VIDEO_YUV_RAW ? 0 : -1;
}
int freenect_start_depth(freenect_device* device) { return device->depth_on = true, 0; }
int freenect_start_video(freenect_device* device) { return device->video_on = true, 0; }
int freenect_stop_depth(freenect_device* device) { return device->depth_on = false, 0; }
int freenect_stop_video(freenect_device* device) { return device->video_on = false, 0; }
int freenect_set_flag(freenect_device*, freenect_flag flag, freenect_flag_value value) {
  if (flag == FREENECT_MIRROR_DEPTH) fake_kinect().mirrored = value == FREENECT_ON;
  if (flag == FREENECT_AUTO_EXPOSURE) fake_kinect().automatic = value == FREENECT_ON;
  return 0;
}
int freenect_set_led(freenect_device*, freenect_led_options option) {
  fake_kinect().led = option;
  return 0;
}
int freenect_set_tilt_degs(freenect_device*, double) {
  ++fake_kinect().tilts;
  return 0;
}
/// 30 depth frames a second, every second time a picture.
int freenect_process_events_timeout(freenect_context*, timeval* timeout) {
  if (!fake_kinect().present) return -4;
  const auto next = g_device.begin + std::chrono::microseconds(1'000'000LL * (g_device.frames + 1) / 30);
  const auto latest = std::chrono::steady_clock::now() + std::chrono::microseconds(timeout->tv_usec);
  std::this_thread::sleep_until(std::min(next, latest));
  if (next > latest) return 0;
  const unsigned n = ++g_device.frames;
  const unsigned ticks = fake_kinect().first_ticks + n * kTicksPerFrame;
  if (fake_kinect().stalled) return 0;
  if (fake_kinect().skip_depth > 0) {
    --fake_kinect().skip_depth;
  } else if (g_device.depth_on) {
    for (std::size_t i = 0; i < g_depth.size(); ++i) g_depth[i] = static_cast<std::uint16_t>(500 + (i + n) % 4000);
    g_device.depth(&g_device, g_depth.data(), ticks);
  }
  if (g_device.video_on && n % 2 == 0 && !fake_kinect().color_stalled) {
    for (std::size_t i = 0; i < g_video.size(); ++i)
      g_video[i] = static_cast<std::uint8_t>(i % 2 == 1 ? i / 2 + n : 128);
    g_device.video(&g_device, g_video.data(), ticks);
  }
  return 0;
}
}
