/// The strings by which a test moves the virtual depth sensor that lives in a driver of OpenNI.
#pragma once

#include <atomic>
#include <cstdint>

namespace firstlook::test {

inline constexpr const char* kTestDepthUri = "firstlook://depth";
inline constexpr int kTestDepthWidth = 64, kTestDepthHeight = 48;
inline constexpr double kTestHorizontalFov_rad = 1.0, kTestVerticalFov_rad = 0.78;

/// In the driver under the name firstlook_test_depth.
struct TestDepth {
  std::atomic<bool> present{true};
  std::atomic<bool> stalled{false};
  std::atomic<bool> always_mirrored{false};
  std::atomic<bool> always_registered{false};
  std::atomic<int> skip{0};  ///< so many frames are not delivered
  std::atomic<int> frames{0};
  void (*unplug)() = nullptr;  ///< tells the library
  void (*plug)() = nullptr;
};

/// What pixel (x, y) of frame n shows, unmirrored, in millimetres.
inline std::uint16_t test_depth_mm(std::uint32_t frame, int x, int y) {
  return static_cast<std::uint16_t>(500 + 7 * x + 11 * y + static_cast<int>(frame % 50));
}

}  // namespace firstlook::test
