/// A calibration with every value that hand_eye.yaml holds, for tests of what is made of it.
#pragma once

#include "app/dataset/hand_eye_file.hpp"

namespace firstlook {

inline StoredCalibration sample_calibration() {
  StoredCalibration c;
  c.accepted = true;
  c.arm_model = "ur5";
  c.kinematics = kinematics_checksum(*find_arm_model("ur5"));
  c.flange_T_camera = Transform<Flange, Camera>(Eigen::Quaterniond(0.99, 0.1, -0.02, 0.03), {0.001, -0.07, 0.06});
  Matrix6d root = 1e-4 * Matrix6d::Identity();
  root(3, 1) = 0.4e-4;
  root(5, 0) = -0.3e-4;
  c.covariance = root * root.transpose();
  c.corner_sigma_px = 0.025;
  c.arm_sigma = {1.1e-4, 1.9e-4};
  c.intrinsics = {640, 480, 537.33, 538.35, 321.61, 252.18, 0.17938, -0.31818, -0.00268, 0.00209, 0};
  c.camera_T_depth = Transform<Camera, Depth>(Eigen::Quaterniond(1, 0.001, 0, 0), {-0.025, 0, 0});
  c.solver = "park-martin";
  c.views = 15;
  c.views_given = 16;
  c.reprojection_rms_px = 0.024;
  c.holdout_rms_px = 0.16;
  c.usable_distance_m = 28.4;
  return c;
}

}  // namespace firstlook
