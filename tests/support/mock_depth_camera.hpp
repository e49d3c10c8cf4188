/// A scripted depth camera: a flat wall in front of it, or what the test paints.
#pragma once

#include <algorithm>
#include <functional>

#include "tests/support/mock_stream.hpp"

namespace firstlook::mock {

class MockDepthCamera final : public MockStream<hal::DepthCamera> {
 public:
  explicit MockDepthCamera(const CameraIntrinsics& intrinsics = {64, 48, 58, 58, 31.5, 23.5},
                           Duration period = milliseconds(33))
      : MockStream(intrinsics, period) {}

  double wall_m = 1.5;
  double stated_units_per_m = 1000;  ///< what it says; pictures come in millimetres
  std::function<void(const hal::Frame&, ImageView<std::uint16_t>)> paint;  ///< none: the wall

  [[nodiscard]] double units_per_m() const override { return stated_units_per_m; }
  [[nodiscard]] Status read(const hal::Frame& frame, ImageView<std::uint16_t> image) override {
    if (!holds(frame)) return failure(Fault::kFrameGone, "depth frame {}", frame.sequence);
    if (!fits(image)) return failure(Fault::kFrameRefused, "wrong size");
    if (paint) {
      paint(frame, image);
    } else {
      std::ranges::fill(image.pixels(), static_cast<std::uint16_t>(wall_m * 1000 + 0.5));
    }
    return {};
  }
};

}  // namespace firstlook::mock
