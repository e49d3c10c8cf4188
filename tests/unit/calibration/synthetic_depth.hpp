/// Depth images of a board on a panel before a wall, from a known truth and known noise.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "algorithms/calibration/depth_to_color.hpp"
#include "algorithms/vision/board_pose.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

namespace firstlook::test {

struct DepthSetup {
  Setup color;
  CameraIntrinsics depth{160, 120, 146, 146, 79.5, 59.5, 0, 0, 0, 0, 0};
  Pose camera_T_depth = Pose::Identity();
  double depth_scale = 1;
  double noise_at_1m = 0.00285;
  double panel_margin_m = 0.06;  ///< of the panel beyond the outer points
  double wall_m = 2.0;
  double units_per_m = 1000;

  DepthSetup() { camera_T_depth.translation() = Eigen::Vector3d(-0.025, 0, 0); }
};

/// An image with room for its pixels.
struct OwnedDepth {
  std::vector<std::uint16_t> units;
  CameraIntrinsics camera;
  double units_per_m = 1000;
  [[nodiscard]] DepthImage image() const { return {{units.data(), camera.width, camera.height}, units_per_m}; }
  [[nodiscard]] std::uint16_t& at(int u, int v) {
    return units[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) + static_cast<std::size_t>(u)];
  }
};

/// True depth of the board's panel or the wall at a pixel.
inline double true_depth(const DepthSetup& s, const Pose& depth_T_board, const Eigen::Vector3d& ray) {
  const Eigen::Vector3d n = depth_T_board.linear().col(2);
  const double z = n.dot(depth_T_board.translation()) / n.dot(ray);
  if (!(z > 0)) return s.wall_m;
  const Eigen::Vector3d p = depth_T_board.inverse(Eigen::Isometry) * (z * ray);
  const Eigen::Vector3d last = s.color.board.corner(s.color.board.corners() - 1);
  const bool on = p.x() > -s.panel_margin_m && p.x() < last.x() + s.panel_margin_m && p.y() > -s.panel_margin_m &&
                  p.y() < last.y() + s.panel_margin_m;
  return on ? z : s.wall_m;
}

inline OwnedDepth observe_depth(const DepthSetup& s, const Pose& camera_T_board, Random& random) {
  const Pose depth_T_board = s.camera_T_depth.inverse(Eigen::Isometry) * camera_T_board;
  OwnedDepth depth{{}, s.depth, s.units_per_m};
  for (int v = 0; v < s.depth.height; ++v) {
    for (int u = 0; u < s.depth.width; ++u) {
      const Eigen::Vector3d ray((u - s.depth.cx) / s.depth.fx, (v - s.depth.cy) / s.depth.fy, 1);
      const double z = s.depth_scale * true_depth(s, depth_T_board, ray);
      const double noisy = 1 / (1 / z + s.noise_at_1m * random.normal());
      depth.units.push_back(static_cast<std::uint16_t>(std::lround(std::clamp(noisy, 0.0, 60.0) * s.units_per_m)));
    }
  }
  return depth;
}

/// A stop as a job sees it: the board's pose from noisy corners, the plane from a noisy image in which `prior` says
/// where to look.
inline DepthStop observe_stop(const DepthSetup& s, const Pose& camera_T_board, const Pose& prior, Random& random) {
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < s.color.board.corners(); ++i) {
    const auto pixel = project(s.color.camera, camera_T_board * s.color.board.corner(i));
    corners.push_back(pixel.value() + s.color.corner_sigma_px * Eigen::Vector2d(random.normal(), random.normal()));
  }
  const auto pose = estimate_board_pose(s.color.camera, s.color.board, corners).value();
  const OwnedDepth depth = observe_depth(s, camera_T_board, random);
  const Pose expected = prior.inverse(Eigen::Isometry) * pose.camera_T_board.pose();
  const auto plane = find_board_plane(depth.image(), s.depth, s.color.board, Transform<Depth, Board>(expected)).value();
  return {pose.camera_T_board, s.color.corner_sigma_px * s.color.corner_sigma_px * pose.unit_covariance, plane,
          s.color.board.center()};
}

}  // namespace firstlook::test
