/// A scripted colour camera: pictures of one grey value, or corners, as the test says.
#pragma once

#include <algorithm>
#include <functional>

#include "tests/support/mock_stream.hpp"

namespace firstlook::mock {

class MockColorCamera final : public MockStream<hal::ColorCamera> {
 public:
  explicit MockColorCamera(const CameraIntrinsics& intrinsics = {64, 48, 60, 60, 31.5, 23.5},
                           Duration period = milliseconds(66))
      : MockStream(intrinsics, period) {}

  std::uint8_t gray = 128;  ///< of every pixel
  /// Of a frame and a target; none: pixels only.
  std::function<std::optional<hal::CornerObservation>(const hal::Frame&, int)> corners;

  [[nodiscard]] Status read(const hal::Frame& frame, MutableGrayImage image) override {
    if (!holds(frame)) return failure(Fault::kFrameGone, "colour frame {}", frame.sequence);
    if (!fits(image)) return failure(Fault::kFrameRefused, "wrong size");
    std::ranges::fill(image.pixels(), gray);
    return {};
  }
  /// Of every pixel; none: a grey camera.
  std::optional<std::array<std::uint8_t, 3>> color;
  [[nodiscard]] bool delivers_color() const override { return color.has_value(); }
  [[nodiscard]] Status read_color(const hal::Frame& frame, ImageView<std::array<std::uint8_t, 3>> image) override {
    if (!color) return hal::ColorCamera::read_color(frame, image);
    if (!holds(frame)) return failure(Fault::kFrameGone, "colour frame {}", frame.sequence);
    if (!fits(image)) return failure(Fault::kFrameRefused, "wrong size");
    std::ranges::fill(image.pixels(), *color);
    return {};
  }
  [[nodiscard]] std::optional<hal::CornerObservation> read_corners(const hal::Frame& frame, int target) override {
    if (!corners || !holds(frame)) return std::nullopt;
    return corners(frame, target);
  }
};

}  // namespace firstlook::mock
