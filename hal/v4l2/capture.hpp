/// One V4L2 device as a stream of buffers: opened, negotiated, mapped, started; and all of it undone. The only file of
/// the driver that knows ioctls.
#pragma once

#include <poll.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "hal/v4l2/pixels.hpp"
#include "platform/core/fixed_text.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/linux/system_calls.hpp"

namespace firstlook::v4l2 {

/// A control that holds still during the job; restored when the device is closed.
struct ControlSetting {
  std::uint32_t id = 0;
  std::int32_t value = 0;
  const char* name = "";
};

struct CaptureOptions {
  std::string device;  ///< a path below /dev/v4l/by-id or by-path keeps its meaning after a replug
  int width = 640, height = 480;
  double rate_hz = 30;
  FixedVector<PixelFormat, 4> formats;       ///< the first that the driver grants is used
  FixedVector<ControlSetting, 12> controls;  ///< in this order: an automatic is switched off before its value is set
};

enum class CaptureTrouble : std::uint8_t {
  kNone,
  kAbsent,     ///< no such device, or it went away
  kForbidden,  ///< the program may not open it
  kBusy,       ///< another program streams from it
  kNoCapture,  ///< a device that gives no video in the way we need
  kFormat,     ///< it grants neither size nor format: granted()
  kMemory,     ///< it grants fewer than two buffers
  kFailed,     ///< a call failed otherwise: failed_call(), last_error()
};

enum class StampKind : std::uint8_t { kUnknown, kEndOfFrame, kStartOfExposure };

struct CapturedBuffer {
  std::span<const std::uint8_t> bytes;  ///< valid until it is given back
  std::uint32_t index = 0;
  std::uint32_t sequence = 0;
  bool broken = false;  ///< the driver says that its content may be wrong
  StampKind stamp = StampKind::kUnknown;
  std::int64_t monotonic_ns = 0;  ///< where the stamp is known
};

/// What the driver has granted.
struct Granted {
  std::uint32_t fourcc = 0;
  PictureLayout layout;
  std::size_t bytes_max = 0;  ///< of a buffer
  double rate_hz = 0;         ///< 0: it does not say
  FixedText<32> driver, card;
  FixedText<96> notes;  ///< controls that it does not have or did not take
};

/// A buffer of the driver in our memory.
struct MappedBuffer {
  void* address = nullptr;
  std::size_t size = 0;
};

/// A control as it was before.
struct SavedControl {
  std::uint32_t id = 0;
  std::int32_t value = 0;
};

/// Not thread-safe. open() and close() ask the camera itself and may take up to a second with USB; the rest does not
/// block. Nothing allocates after construction.
class Capture {
 public:
  Capture(SystemCalls& system, const CaptureOptions& options) : system_(system), options_(options) {}
  ~Capture() { close(); }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;

  /// Streams afterwards; otherwise everything is closed again.
  [[nodiscard]] CaptureTrouble open();
  /// Stops, puts the controls back, closes. A device that went away is only forgotten.
  void close();
  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }
  /// Waits for a frame, so many milliseconds at most. False when none came, or the driver says that none can.
  [[nodiscard]] bool wait(int longest_ms) const {
    pollfd frame{descriptor_, POLLIN, 0};
    return is_open() && system_.poll(&frame, 1, longest_ms) > 0 && (frame.revents & POLLIN) != 0;
  }

  enum class Taken : std::uint8_t { kBuffer, kNothing, kInputError, kLost };
  /// The next filled buffer. kInputError: the signal was disturbed (EIO), the stream may go on. kLost: the device is
  /// gone or failed; close it.
  [[nodiscard]] Taken take(CapturedBuffer& buffer);
  /// Gives it back to be filled again. False: the device is gone or failed.
  [[nodiscard]] bool give_back(const CapturedBuffer& buffer);

  [[nodiscard]] const Granted& granted() const { return granted_; }
  [[nodiscard]] CaptureTrouble trouble() const { return trouble_; }
  [[nodiscard]] const char* failed_call() const { return failed_call_; }
  [[nodiscard]] int last_error() const { return error_; }

 private:
  static constexpr std::uint32_t kBuffers = 4;

  CaptureTrouble fail(const char* call, int error);
  CaptureTrouble negotiate();
  void fix_controls();
  void restore_controls();
  CaptureTrouble map_buffers();
  void ask_rate();

  SystemCalls& system_;
  CaptureOptions options_;
  int descriptor_ = -1;
  bool gone_ = false;
  Granted granted_;
  CaptureTrouble trouble_ = CaptureTrouble::kNone;
  const char* failed_call_ = "";
  int error_ = 0;
  FixedVector<MappedBuffer, kBuffers> mapped_;
  FixedVector<SavedControl, 12> saved_;
};

}  // namespace firstlook::v4l2
