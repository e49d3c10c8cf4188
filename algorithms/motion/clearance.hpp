/// The clearance of DESIGN rule 5, term by term.
#pragma once

#include "algorithms/motion/free_space.hpp"

namespace firstlook {

struct ClearanceInputs {
  double voxel_m = 0.05;
  double range_m = 1.5;             ///< z: how far the camera was from what it saw
  double sigma_hand_eye_m = 0;      ///< translation, one sigma
  double sigma_hand_eye_rad = 0;    ///< rotation, one sigma
  double sigma_depth_camera_m = 0;  ///< the depth camera on the colour camera, one sigma
  double sigma_depth_camera_rad = 0;
  double sigma_depth_scale = 0;         ///< of how much too long its depths are
  double sigma_depth_floor_m = 0;       ///< at any distance, together with
  double sigma_depth_at_1m_m = 0.0015;  ///< grows with z^2 (FACTS: Kinect, a few mm at 0.5 m to 4 cm at 5 m)
  double sigma_tracking_m = 0.0005;     ///< arm's pose at a frame's time stamp
  double payload_sag_m = 0.001;
  double speed_m_s = 0.25;
  double reaction_s = 0.016;       ///< two loop turns at 125 Hz
  double deceleration_m_s2 = 2.5;  ///< at the body's outermost point
};

/// Metres; `voxels_m` and `surface_m` are the sums that apply to mapped voxels and to configured surfaces.
struct ClearanceTerms {
  double half_voxel_diagonal_m = 0;
  double sigma_hand_eye_m = 0;      ///< at range_m
  double sigma_depth_m = 0;         ///< at range_m
  double sigma_depth_camera_m = 0;  ///< at range_m: mount and scale
  double sigma_tracking_m = 0;
  double uncertainty_m = 0;  ///< 3 sqrt(sum of the squares of the four above)
  double payload_sag_m = 0;
  double stopping_m = 0;  ///< v t_react + v^2 / 2a
  double voxels_m = 0;    ///< half voxel diagonal + uncertainty + sag + stopping
  double surface_m = 0;   ///< 3 sigma_tracking + sag + stopping: no measurement is involved

  [[nodiscard]] Clearance clearance() const { return {.voxels_m = voxels_m, .surface_m = surface_m}; }
};

/// Half a voxel diagonal + 3 sqrt(s_handeye(z)^2 + s_depth(z)^2 + s_depthcamera(z)^2 + s_tracking^2) + sag + stopping
/// distance.
[[nodiscard]] ClearanceTerms required_clearance(const ClearanceInputs& inputs);

}  // namespace firstlook
