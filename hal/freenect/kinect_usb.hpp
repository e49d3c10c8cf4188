/// One Kinect v1 through libfreenect, from opening to its frames. The adapter to the library: its types end in
/// kinect_usb.cpp.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace firstlook::freenect {

inline constexpr int kWidth = 640, kHeight = 480;
inline constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

struct KinectUsbOptions {
  std::string serial;  ///< of its camera; empty: the first one
  bool depth = true;
  bool color = false;  ///< as YUV, 15 pictures a second
};

enum class KinectTrouble : std::uint8_t {
  kNone,
  kLibrary,   ///< libfreenect does not start: no USB
  kNoDevice,  ///< no Kinect is there
  kNotOpen,   ///< it is there and cannot be opened: no rights, in use, no power
  kNoMode,    ///< it refuses the mode
  kNotStarted,
};

/// Told of frames, on the thread that calls process(). The memory is the library's.
class KinectFrames {
 public:
  virtual ~KinectFrames() = default;
  /// Millimetres, as the depth camera sees them; 0: no return. @param ticks  of the Kinect's 60 MHz clock
  virtual void depth_came(std::span<const std::uint16_t, kPixels> pixels, std::uint32_t ticks) = 0;
  /// UYVY, 2 bytes a pixel.
  virtual void color_came(std::span<const std::uint8_t, 2 * kPixels> bytes, std::uint32_t ticks) = 0;
};

/// For one thread. The tilt motor is never moved: the Kinect is mounted, and its tilt belongs to the calibration.
class KinectUsb {
 public:
  KinectUsb();
  ~KinectUsb();
  KinectUsb(const KinectUsb&) = delete;
  KinectUsb& operator=(const KinectUsb&) = delete;

  /// May take seconds. Registration and mirroring are off, exposure and white balance held, the light is green.
  [[nodiscard]] KinectTrouble open(const KinectUsbOptions& options, KinectFrames& frames);
  void close();
  /// Handles what comes within `timeout_ms`. False: the device is gone, or failed.
  [[nodiscard]] bool process(int timeout_ms);

 private:
  struct Library;
  KinectTrouble fail(KinectTrouble trouble);
  std::unique_ptr<Library> library_;
};

}  // namespace firstlook::freenect
