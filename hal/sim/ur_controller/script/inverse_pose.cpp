#include "hal/sim/ur_controller/script/inverse_pose.hpp"

#include "algorithms/kinematics/inverse_kinematics.hpp"

namespace firstlook::sim::ur::script {

std::optional<JointVector> joints_at(const Controller& controller, const Pose& base_T_tcp,
                                     const JointVector& near_rad) {
  const Transform<Base, Flange> base_T_flange(base_T_tcp * controller.flange_T_tcp().inverse(Eigen::Isometry));
  std::optional<JointVector> nearest;
  for (const JointVector& q : inverse(controller.identity().arm, base_T_flange, near_rad)) {
    if (!nearest || (q - near_rad).max_abs() < (*nearest - near_rad).max_abs()) nearest = q;
  }
  return nearest;
}

}  // namespace firstlook::sim::ur::script
