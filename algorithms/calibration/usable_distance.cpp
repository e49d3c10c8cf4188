/// What a hand-eye covariance means at a distance.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "algorithms/calibration/verdict.hpp"

namespace firstlook {

double usable_distance_of_errors(const Eigen::Vector3d& translation_m, double pitch_rad, double yaw_rad,
                                 double tolerance_m) {
  constexpr double kDistanceMax_m = 100;
  constexpr double kAngleMax_rad = std::numbers::pi / 2;
  const double left_m = tolerance_m - translation_m.lpNorm<1>();
  if (!(left_m > 0) || !(std::abs(pitch_rad) < kAngleMax_rad) || !(std::abs(yaw_rad) < kAngleMax_rad)) return 0;
  const double slope = std::hypot(std::tan(pitch_rad), std::tan(yaw_rad));
  return slope * kDistanceMax_m <= left_m ? kDistanceMax_m : left_m / slope;
}

double usable_distance(const Transform<Flange, Camera>& flange_T_camera, const Matrix6d& covariance,
                       double tolerance_m) {
  constexpr double kSigmas = 3;
  const Eigen::Vector3d translation = kSigmas * covariance.diagonal().head<3>().cwiseMax(0).cwiseSqrt();
  // Pitch and yaw are turns about the camera's x and y, roll is about its optical axis.
  const Eigen::Matrix3d in_camera =
      flange_T_camera.rotation().transpose() * covariance.bottomRightCorner<3, 3>() * flange_T_camera.rotation();
  const Eigen::Vector3d rotation = kSigmas * in_camera.diagonal().cwiseMax(0).cwiseSqrt();
  return usable_distance_of_errors(translation, rotation.x(), rotation.y(), tolerance_m);
}

double point_sigma(const Transform<Flange, Camera>& flange_T_camera, const Matrix6d& covariance, double distance_m) {
  const Eigen::Vector3d from_camera = flange_T_camera.rotation().col(2) * distance_m;
  Eigen::Matrix<double, 3, 6> j;
  j << Eigen::Matrix3d::Identity(), -cross_matrix(from_camera);
  const Eigen::Matrix3d spread = j * covariance * j.transpose();
  return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues()(2)));
}

}  // namespace firstlook
