/// The piece of memory through which the rig's cameras hand depth frames to the driver below OpenNI.
#pragma once

#include <atomic>
#include <cstdint>

namespace firstlook::rig {

inline constexpr int kDepthWidth = 160, kDepthHeight = 120;  // cell.yaml: an emulated computer renders slowly

/// The writer makes `turn` odd, writes, makes it even: a reader that saw two different or odd values reads again.
struct DepthWindow {
  std::atomic<std::uint32_t> turn;
  std::uint32_t frame;
  std::uint64_t stamp_us;  ///< CLOCK_MONOTONIC, middle of the exposure
  float horizontal_fov_rad, vertical_fov_rad;
  std::uint16_t depth_mm[kDepthWidth * kDepthHeight];
};

inline constexpr const char* kDepthWindowPath = "/dev/shm/firstlook-depth";

}  // namespace firstlook::rig
