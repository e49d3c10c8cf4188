/// Where each pixel of a camera looks, computed once.
#pragma once

#include <cstddef>
#include <vector>

#include "platform/core/camera_intrinsics.hpp"

namespace firstlook::sim {

/// Normalised undistorted image points (x/z, y/z) of all pixel centres, row-major.
struct PixelRays {
  /// A pixel whose distortion cannot be inverted takes its pinhole ray.
  explicit PixelRays(const CameraIntrinsics& intrinsics);
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(column);
  }

  CameraIntrinsics camera;
  std::vector<float> x, y;
};

/// The same field of view with `factor` times `factor` pixels in one.
[[nodiscard]] CameraIntrinsics binned(const CameraIntrinsics& camera, int factor);

}  // namespace firstlook::sim
