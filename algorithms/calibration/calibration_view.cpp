#include "algorithms/calibration/calibration_view.hpp"

namespace firstlook {

Vector6d pose_difference(const Pose& truth, const Pose& estimate) {
  Vector6d difference;
  difference << truth.translation() - estimate.translation(),
      rotation_log(truth.linear() * estimate.linear().transpose());
  return difference;
}

Pose perturb(const Pose& estimate, const Vector6d& difference) {
  Pose result = Pose::Identity();
  result.linear() = rotation_exp(difference.tail<3>()) * estimate.linear();
  result.translation() = estimate.translation() + difference.head<3>();
  return result;
}

}  // namespace firstlook
