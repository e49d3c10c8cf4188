#include "hal/freenect/kinect_usb.hpp"

#include <libfreenect.h>
#include <sys/time.h>

namespace firstlook::freenect {

struct KinectUsb::Library {
  freenect_context* context = nullptr;
  freenect_device* device = nullptr;
  KinectFrames* frames = nullptr;
  KinectUsbOptions options;
};

namespace {

KinectFrames& frames_of(freenect_device* device) { return *static_cast<KinectFrames*>(freenect_get_user(device)); }

void depth_came(freenect_device* device, void* pixels, std::uint32_t ticks) {
  frames_of(device).depth_came(
      std::span<const std::uint16_t, kPixels>(static_cast<const std::uint16_t*>(pixels), kPixels), ticks);
}

void color_came(freenect_device* device, void* bytes, std::uint32_t ticks) {
  frames_of(device).color_came(
      std::span<const std::uint8_t, 2 * kPixels>(static_cast<const std::uint8_t*>(bytes), 2 * kPixels), ticks);
}

/// The library speaks on stderr by itself; what matters shows in its return values.
void say_nothing(freenect_context*, freenect_loglevel, const char*) {}

}  // namespace

KinectUsb::KinectUsb() : library_(std::make_unique<Library>()) {}
KinectUsb::~KinectUsb() { close(); }

KinectTrouble KinectUsb::fail(KinectTrouble trouble) {
  close();
  return trouble;
}

KinectTrouble KinectUsb::open(const KinectUsbOptions& options, KinectFrames& frames) {
  close();
  Library& l = *library_;
  l.options = options;
  if (freenect_init(&l.context, nullptr) < 0) {
    l.context = nullptr;
    return KinectTrouble::kLibrary;
  }
  freenect_set_log_callback(l.context, say_nothing);
  freenect_set_log_level(l.context, FREENECT_LOG_ERROR);
  if (freenect_num_devices(l.context) <= 0) return fail(KinectTrouble::kNoDevice);
  freenect_select_subdevices(l.context,
                             static_cast<freenect_device_flags>(FREENECT_DEVICE_MOTOR | FREENECT_DEVICE_CAMERA));
  const int opened = options.serial.empty()
                         ? freenect_open_device(l.context, &l.device, 0)
                         : freenect_open_device_by_camera_serial(l.context, &l.device, options.serial.c_str());
  if (opened < 0) {
    l.device = nullptr;
    return fail(KinectTrouble::kNotOpen);
  }
  freenect_set_user(l.device, &frames);
  if (options.depth) {
    // In millimetres by the Kinect's own factory data, not warped to its colour camera.
    const freenect_frame_mode mode = freenect_find_depth_mode(FREENECT_RESOLUTION_MEDIUM, FREENECT_DEPTH_MM);
    if (mode.is_valid == 0 || mode.bytes != 2 * static_cast<int>(kPixels) ||
        freenect_set_depth_mode(l.device, mode) < 0) {
      return fail(KinectTrouble::kNoMode);
    }
    freenect_set_depth_callback(l.device, depth_came);
    if (freenect_start_depth(l.device) < 0) return fail(KinectTrouble::kNotStarted);
  }
  if (options.color) {
    const freenect_frame_mode mode = freenect_find_video_mode(FREENECT_RESOLUTION_MEDIUM, FREENECT_VIDEO_YUV_RAW);
    if (mode.is_valid == 0 || mode.bytes != 2 * static_cast<int>(kPixels) ||
        freenect_set_video_mode(l.device, mode) < 0) {
      return fail(KinectTrouble::kNoMode);
    }
    freenect_set_video_callback(l.device, color_came);
    if (freenect_start_video(l.device) < 0) return fail(KinectTrouble::kNotStarted);
  }
  // The Kinect for Windows knows not all of them; what it refuses it does not do.
  (void)freenect_set_flag(l.device, FREENECT_MIRROR_DEPTH, FREENECT_OFF);
  (void)freenect_set_flag(l.device, FREENECT_MIRROR_VIDEO, FREENECT_OFF);
  (void)freenect_set_flag(l.device, FREENECT_AUTO_EXPOSURE, FREENECT_OFF);
  (void)freenect_set_flag(l.device, FREENECT_AUTO_WHITE_BALANCE, FREENECT_OFF);
  (void)freenect_set_led(l.device, LED_GREEN);
  return KinectTrouble::kNone;
}

void KinectUsb::close() {
  Library& l = *library_;
  if (l.device != nullptr) {
    if (l.options.depth) (void)freenect_stop_depth(l.device);
    if (l.options.color) (void)freenect_stop_video(l.device);
    (void)freenect_set_led(l.device, LED_OFF);
    (void)freenect_close_device(l.device);
    l.device = nullptr;
  }
  if (l.context != nullptr) (void)freenect_shutdown(l.context);
  l.context = nullptr;
}

bool KinectUsb::process(int timeout_ms) {
  if (library_->device == nullptr) return false;
  timeval timeout{timeout_ms / 1000, timeout_ms % 1000 * 1000};
  return freenect_process_events_timeout(library_->context, &timeout) >= 0;
}

}  // namespace firstlook::freenect
