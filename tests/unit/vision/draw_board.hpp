/// Draws a target through a camera by averaging rays over each pixel: an image with known corners.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/target_pattern.hpp"
#include "platform/core/random.hpp"
#include "platform/core/transform.hpp"

namespace firstlook::test {

struct DrawnImage {
  std::vector<std::uint8_t> pixels;
  int width = 0;
  int height = 0;
  [[nodiscard]] GrayImage view() const { return {pixels.data(), width, height}; }
};

struct DrawOptions {
  double black = 30, white = 220, wall = 130;
  double noise = 2;  ///< grey levels
  std::uint64_t seed = 1;
  double blur_px = 0;  ///< sigma of a Gaussian
  /// True where something stands before the target, in board coordinates; it is as dark as the wall.
  std::function<bool(const Eigen::Vector2d&)> hidden{};
};

/// The square (column, row) whose corner with the smallest coordinates is inner corner (column, row) is black when
/// column + row is even: the convention of BoardSpec. A white rim of one square surrounds the board.
inline double board_grey(const BoardSpec& b, const Eigen::Vector2d& p, const DrawOptions& o) {
  if (o.hidden && o.hidden(p)) return o.wall;
  if (b.type != TargetType::kCheckerboard) {
    const InkExtent ink = ink_extent(b);
    const Eigen::Vector2d beyond = (p - ink.center_m).cwiseAbs() - ink.size_m / 2;
    if (beyond.maxCoeff() > std::max(0.01, quiet_zone_m(b))) return o.wall;
    return is_dark(b, p.x(), p.y()) ? o.black : o.white;
  }
  const double x = p.x() / b.square_size_m, y = p.y() / b.square_size_m;
  if (x < -2 || y < -2 || x > b.inner_columns + 1 || y > b.inner_rows + 1) return o.wall;
  if (x < -1 || y < -1 || x > b.inner_columns || y > b.inner_rows) return o.white;
  const long parity = static_cast<long>(std::floor(x)) + static_cast<long>(std::floor(y));
  return (parity % 2 == 0) ? o.black : o.white;
}

inline void blur(std::vector<double>& grey, int width, int height, double sigma_px) {
  const int reach = static_cast<int>(std::ceil(3 * sigma_px));
  std::vector<double> taps;
  double total = 0;
  for (int k = -reach; k <= reach; ++k) total += taps.emplace_back(std::exp(-0.5 * k * k / (sigma_px * sigma_px)));
  for (const bool rows : {true, false}) {
    const std::vector<double> from = grey;
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        double sum = 0;
        for (int k = -reach; k <= reach; ++k) {
          const int uu = std::clamp(rows ? u + k : u, 0, width - 1), vv = std::clamp(rows ? v : v + k, 0, height - 1);
          sum += taps[static_cast<std::size_t>(k + reach)] * from[static_cast<std::size_t>(vv * width + uu)];
        }
        grey[static_cast<std::size_t>(v * width + u)] = sum / total;
      }
    }
  }
}

inline DrawnImage draw_board(const CameraIntrinsics& camera, const BoardSpec& board, const Pose& camera_T_board,
                             const DrawOptions& options = {}) {
  DrawnImage image{{}, camera.width, camera.height};
  Random random(options.seed, 77);
  const Pose board_T_camera = camera_T_board.inverse(Eigen::Isometry);
  constexpr int kSub = 4;
  std::vector<double> greys;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      double sum = 0;
      const auto middle = undistort(camera, {u, v});
      if (!middle) {
        greys.push_back(options.wall);
        continue;
      }
      // Over one pixel the distortion is linear to 1e-5 px.
      const Eigen::Matrix2d normalized_d_pixel =
          distort_jacobian(camera, *middle).inverse() * Eigen::Vector2d(1 / camera.fx, 1 / camera.fy).asDiagonal();
      for (int s = 0; s < kSub * kSub; ++s) {
        const Eigen::Vector2d offset((s % kSub + 0.5) / kSub - 0.5, (s / kSub + 0.5) / kSub - 0.5);
        const Eigen::Vector2d ray = *middle + normalized_d_pixel * offset;
        const Eigen::Vector3d direction = board_T_camera.linear() * Eigen::Vector3d(ray.x(), ray.y(), 1);
        const double t = -board_T_camera.translation().z() / direction.z();
        const Eigen::Vector3d hit = board_T_camera.translation() + t * direction;
        sum += t > 0 ? board_grey(board, hit.head<2>(), options) : options.wall;
      }
      greys.push_back(sum / (kSub * kSub));
    }
  }
  if (options.blur_px > 0) blur(greys, camera.width, camera.height, options.blur_px);
  for (const double grey : greys) {
    image.pixels.push_back(
        static_cast<std::uint8_t>(std::clamp(std::lround(grey + options.noise * random.normal()), 0L, 255L)));
  }
  return image;
}

/// The camera looks at the board's centre from `distance_m`, the board tilted about an axis in its plane and rolled.
inline Pose look_at_board(const BoardSpec& board, double distance_m, double tilt_rad, double tilt_axis_rad,
                          double roll_rad) {
  Pose pose = Pose::Identity();
  const Eigen::Vector3d axis(std::cos(tilt_axis_rad), std::sin(tilt_axis_rad), 0);
  pose.linear() = (Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(tilt_rad, axis)).matrix();
  pose.translation() = Eigen::Vector3d(0, 0, distance_m) - pose.linear() * board.center();
  return pose;
}

}  // namespace firstlook::test
