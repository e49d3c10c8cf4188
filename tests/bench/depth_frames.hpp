/// Depth frames to map: rendered in the simulated cell "workshop", or of a recorded dataset.
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/mapping/depth_rays.hpp"
#include "tests/bench/bench.hpp"

namespace firstlook::bench {

struct DepthFrame {
  std::vector<std::uint16_t> values;
  Transform<Base, Depth> base_T_depth;
};

/// Frames of one sensor.
struct DepthFrames {
  DepthSensor sensor;  ///< trusted as far as it sees, so that insertion is OctoMap's
  double units_per_m = 1000;
  std::vector<DepthFrame> frames;

  [[nodiscard]] DepthImage image(const DepthFrame& frame) const {
    return {{frame.values.data(), sensor.intrinsics.width, sensor.intrinsics.height}, units_per_m};
  }
};

/// Where the frames look from: their mean depth lies within 15 % of `mean_depth_m`.
struct FrameWish {
  double mean_depth_m = 1.7;
  int count = 0;
};

/// Full 640x480 frames with the whole sensor model; poses are drawn from a fixed seed. With options.dataset its first
/// `count` frames, whatever their depth. Ends the program with exit code 3 when the dataset cannot be read.
[[nodiscard]] DepthFrames depth_frames(const Options& options, const FrameWish& wish);

/// The smallest grid that holds every ray of the frames, and a voxel around it.
[[nodiscard]] GridGeometry grid_around(const DepthFrames& frames, double resolution_m);

}  // namespace firstlook::bench
