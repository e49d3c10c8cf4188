#include "algorithms/motion/clearance.hpp"

#include <cmath>

#include "platform/core/ensure.hpp"

namespace firstlook {

ClearanceTerms required_clearance(const ClearanceInputs& in) {
  ENSURE(4111, in.deceleration_m_s2 > 0);
  ClearanceTerms t;
  t.half_voxel_diagonal_m = in.voxel_m * std::sqrt(3.0) / 2;
  t.sigma_hand_eye_m = std::hypot(in.sigma_hand_eye_m, in.sigma_hand_eye_rad * in.range_m);
  t.sigma_depth_m = std::hypot(in.sigma_depth_floor_m, in.sigma_depth_at_1m_m * in.range_m * in.range_m);
  t.sigma_tracking_m = in.sigma_tracking_m;
  t.sigma_depth_camera_m =
      std::hypot(in.sigma_depth_camera_m, in.sigma_depth_camera_rad * in.range_m, in.sigma_depth_scale * in.range_m);
  t.uncertainty_m =
      3 * std::hypot(std::hypot(t.sigma_hand_eye_m, t.sigma_depth_camera_m), t.sigma_depth_m, t.sigma_tracking_m);
  t.payload_sag_m = in.payload_sag_m;
  t.stopping_m = in.speed_m_s * in.reaction_s + in.speed_m_s * in.speed_m_s / (2 * in.deceleration_m_s2);
  t.voxels_m = t.half_voxel_diagonal_m + t.uncertainty_m + t.payload_sag_m + t.stopping_m;
  t.surface_m = 3 * t.sigma_tracking_m + t.payload_sag_m + t.stopping_m;
  return t;
}

}  // namespace firstlook
