/// Calibration views made from a known truth and known noise.
#pragma once

#include <numbers>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/calibration/view_design.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/checkerboard.hpp"
#include "platform/core/random.hpp"

namespace firstlook::test {

inline constexpr double kDegree = std::numbers::pi / 180;

/// The published setup: 8x6 corners of 30 mm, tilt to 35 degrees, roll to 60 degrees, 0.1 px, arm 0.1 mm / 0.2 mrad.
struct Setup {
  CameraIntrinsics camera{640, 480, 534.78, 534.10, 308.63, 226.92, .04586, -.1301, .0025, -.0006, 0};
  BoardSpec board{8, 6, 0.03};
  Pose flange_T_camera = Pose::Identity();
  Pose base_T_board = Pose::Identity();
  double corner_sigma_px = 0.1;
  ArmSigma arm_sigma{1e-4, 2e-4};
  double tilt_max_rad = 35 * kDegree;
  double roll_max_rad = 60 * kDegree;
  double distance_min_m = 0.5, distance_max_m = 0.9;

  Setup() {
    flange_T_camera.linear() = rotation_exp({0.1, -0.2, 1.3});
    flange_T_camera.translation() = Eigen::Vector3d(0.05, -0.03, 0.08);
    base_T_board.linear() = rotation_exp({3.0, 0.2, 0.1});
    base_T_board.translation() = Eigen::Vector3d(0.5, 0.1, 0.05);
  }
  [[nodiscard]] ViewDesignModel model() const {
    return {camera,          board,    Transform<Flange, Camera>(flange_T_camera), Transform<Base, Board>(base_T_board),
            corner_sigma_px, arm_sigma};
  }
};

/// Where the camera sees the board's middle near its axis, tilted and rolled at random.
inline Pose random_camera_T_board(const Setup& s, Random& random) {
  const double tilt = s.tilt_max_rad * std::sqrt(random.uniform());
  const double direction = random.uniform(0, 2 * std::numbers::pi);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_exp({0, 0, random.uniform(-s.roll_max_rad, s.roll_max_rad)}) *
                  rotation_exp({tilt * std::cos(direction), tilt * std::sin(direction), 0});
  const double z = random.uniform(s.distance_min_m, s.distance_max_m);
  const Eigen::Vector3d middle(random.uniform(-.1, .1) * z, random.uniform(-.08, .08) * z, z);
  pose.translation() = middle - pose.linear() * s.board.center();
  return pose;
}

/// The true flange pose from which the board is seen at `camera_T_board`.
inline Pose flange_for(const Setup& s, const Pose& camera_T_board) {
  return s.base_T_board * camera_T_board.inverse(Eigen::Isometry) * s.flange_T_camera.inverse(Eigen::Isometry);
}

inline Vector6d arm_noise(const ArmSigma& sigma, Random& random) {
  Vector6d noise;
  noise << sigma.translation_m * random.normal3(), sigma.rotation_rad * random.normal3();
  return noise;
}

/// What camera and arm say from a true flange pose.
inline CalibrationView observe(const Setup& s, const Pose& base_T_flange, Random& random) {
  CalibrationView view;
  const Pose camera_T_board = (base_T_flange * s.flange_T_camera).inverse(Eigen::Isometry) * s.base_T_board;
  for (int i = 0; i < s.board.corners(); ++i) {
    const auto pixel = project(s.camera, camera_T_board * s.board.corner(i));
    view.corners_px.push_back(pixel.value() + s.corner_sigma_px * Eigen::Vector2d(random.normal(), random.normal()));
  }
  view.base_T_flange = Transform<Base, Flange>(perturb(base_T_flange, arm_noise(s.arm_sigma, random)));
  return view;
}

inline std::vector<CalibrationView> observe_views(const Setup& s, int count, Random& random) {
  std::vector<CalibrationView> views;
  for (int i = 0; i < count; ++i) views.push_back(observe(s, flange_for(s, random_camera_T_board(s, random)), random));
  return views;
}

/// Pose pairs whose board poses are exact and whose arm poses carry the arm's noise.
inline std::vector<PosePair> observe_pairs(const Setup& s, int count, Random& random) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < count; ++i) {
    const Pose camera_T_board = random_camera_T_board(s, random);
    const Pose flange = perturb(flange_for(s, camera_T_board), arm_noise(s.arm_sigma, random));
    pairs.push_back({Transform<Base, Flange>(flange), Transform<Camera, Board>(camera_T_board)});
  }
  return pairs;
}

}  // namespace firstlook::test
