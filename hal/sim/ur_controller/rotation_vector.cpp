#include "hal/sim/ur_controller/rotation_vector.hpp"

namespace firstlook::sim::ur {

Pose pose_of(const Vector6& pose) {
  Pose result = Pose::Identity();
  result.translation() = Eigen::Vector3d(pose[0], pose[1], pose[2]);
  const Eigen::Vector3d rotation(pose[3], pose[4], pose[5]);
  const double angle_rad = rotation.norm();
  if (angle_rad > 0) result.linear() = Eigen::AngleAxisd(angle_rad, rotation / angle_rad).toRotationMatrix();
  return result;
}

Eigen::Vector3d rotation_vector_of(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.axis() * turn.angle();
}

Vector6 vector_of(const Pose& pose) {
  const Eigen::Vector3d rotation = rotation_vector_of(pose.linear());
  return {pose.translation().x(), pose.translation().y(), pose.translation().z(),
          rotation.x(),           rotation.y(),           rotation.z()};
}

}  // namespace firstlook::sim::ur
