#include "hal/sim/pixel_rays.hpp"

#include "algorithms/vision/camera_model.hpp"

namespace firstlook::sim {

PixelRays::PixelRays(const CameraIntrinsics& intrinsics) : camera(intrinsics) {
  const auto pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  x.reserve(pixels), y.reserve(pixels);
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const Eigen::Vector2d pinhole((column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy);
      const Eigen::Vector2d at = undistort(camera, Eigen::Vector2d(column, row)).value_or(pinhole);
      x.push_back(static_cast<float>(at.x()));
      y.push_back(static_cast<float>(at.y()));
    }
  }
}

CameraIntrinsics binned(const CameraIntrinsics& camera, int factor) {
  CameraIntrinsics coarse = camera;
  coarse.width /= factor, coarse.height /= factor;
  coarse.fx /= factor, coarse.fy /= factor;
  coarse.cx = (camera.cx + 0.5) / factor - 0.5;
  coarse.cy = (camera.cy + 0.5) / factor - 0.5;
  return coarse;
}

}  // namespace firstlook::sim
