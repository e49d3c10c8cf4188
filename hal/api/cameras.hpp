/// Colour and depth cameras. A frame is a handle; its pixels are fetched in the job that consumes them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"
#include "platform/core/time.hpp"

namespace firstlook::hal {

/// A frame that a device holds for its consumer. `stamp` is the middle of the exposure.
struct Frame {
  Instant stamp{};
  std::uint32_t sequence = 0;  ///< counts frames of the sensor, gaps are lost frames
  std::uint32_t slot = 0;      ///< where the device holds it
};

struct StreamCounters {
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;
};

/// What both kinds of camera have in common. poll and next_due from the loop thread; they never block or allocate. A
/// device holds its last frames (32; large pictures 6 at least); reading an older one gives kFrameGone.
class FrameStream {
 public:
  virtual ~FrameStream() = default;
  [[nodiscard]] virtual const CameraIntrinsics& intrinsics() const = 0;
  /// The newest frame with stamp <= now that was not yet taken. Empty when none came since the last call.
  [[nodiscard]] virtual std::optional<Frame> poll(Instant now) = 0;
  [[nodiscard]] virtual Instant next_due() const = 0;
  [[nodiscard]] virtual StreamCounters counters() const = 0;
};

/// Image points of the board's points (BoardSpec::corner), in their order, as a camera that finds them itself reports
/// them.
struct CornerObservation {
  static constexpr std::size_t kCornersMax = 512;
  FixedVector<std::array<float, 2>, kCornersMax> corners_px;  ///< empty: the board is not seen whole
};

class ColorCamera : public FrameStream {
 public:
  /// Copies the frame's grey values into `image`, which has the size of intrinsics(). May be called on a job's thread.
  [[nodiscard]] virtual Status read(const Frame& frame, MutableGrayImage image) = 0;
  /// Whether read_color() gives pixels. A grey camera has none.
  [[nodiscard]] virtual bool delivers_color() const { return false; }
  /// The same in colours: red, green, blue.
  [[nodiscard]] virtual Status read_color(const Frame& frame, ImageView<std::array<std::uint8_t, 3>>) {
    return failure(Fault::kFrameRefused, "colour frame {}: the camera delivers grey values only", frame.sequence);
  }
  /// Corners of one of the targets that the camera was told to look for, by its number, instead of pixels: for cameras
  /// that deliver them (`--sensor fast`); empty optional: use read().
  [[nodiscard]] virtual std::optional<CornerObservation> read_corners(const Frame& frame, int target) = 0;
};

class DepthCamera : public FrameStream {
 public:
  [[nodiscard]] virtual double units_per_m() const = 0;
  /// Copies the frame's depth into `image` (0: no return), which has the size of intrinsics(). May be called on a job's
  /// thread.
  [[nodiscard]] virtual Status read(const Frame& frame, ImageView<std::uint16_t> image) = 0;
};

}  // namespace firstlook::hal
