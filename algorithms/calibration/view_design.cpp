#include "algorithms/calibration/view_design.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "algorithms/vision/camera_model.hpp"

namespace firstlook {
namespace {

/// Smallest distance between an outer corner and its two neighbours; negative when a corner lies outside the margin.
double smallest_spacing_px(const ViewDesignModel& model, const Transform<Camera, Board>& camera_T_board,
                           double margin_px) {
  const auto pixel = [&](int corner) { return project(model.camera, camera_T_board * model.board.corner(corner)); };
  double smallest = std::numeric_limits<double>::infinity();
  for (const int corner : model.board.outer_corners()) {
    const auto [along_row, along_column] = model.board.neighbours_of_outer(corner);
    const auto here = pixel(corner), beside = pixel(along_row), below = pixel(along_column);
    if (!here || !beside || !below || !in_image(model.camera, *here, margin_px)) return -1;
    smallest = std::min({smallest, (*here - *beside).norm(), (*here - *below).norm()});
  }
  return smallest / model.board.detail_ratio();
}

}  // namespace

ViewFault check_view(const ViewDesignModel& model, const Transform<Base, Flange>& base_T_flange,
                     const ViewLimits& limits) {
  const auto camera_T_board = (base_T_flange * model.flange_T_camera).inverse() * model.base_T_board;
  const Eigen::Vector3d center = camera_T_board * model.board.center();
  const double distance_m = center.norm();
  const double along_normal_m = camera_T_board.rotation().col(2).dot(center);  // the normal points away from the viewer
  if (center.z() <= 0 || along_normal_m <= 0) return ViewFault::kBehind;
  if (distance_m < limits.distance_min_m || distance_m > limits.distance_max_m) return ViewFault::kDistance;
  if (along_normal_m < distance_m * std::cos(limits.tilt_max_rad)) return ViewFault::kTilt;
  const double spacing_px = smallest_spacing_px(model, camera_T_board, limits.margin_px);
  if (spacing_px < 0) return ViewFault::kOutOfImage;
  return spacing_px < limits.spacing_min_px ? ViewFault::kSpacing : ViewFault::kNone;
}

Matrix12d view_information(const ViewDesignModel& model, const Transform<Base, Flange>& base_T_flange) {
  const ViewGeometry geometry{model.flange_T_camera.pose(), model.base_T_board.pose(), base_T_flange.pose()};
  const double weight = 1 / (model.corner_sigma_px * model.corner_sigma_px);
  ViewNormal normal;
  for (int i = 0; i < model.board.corners(); ++i) {
    const auto term = corner_term(model.camera, geometry, model.board.corner(i));
    if (!term) return Matrix12d::Zero();
    normal.add(*term, Eigen::Vector2d::Zero(), weight);
  }
  normal.arm.diagonal().head<3>().array() += std::pow(model.arm_sigma.translation_m, -2);
  normal.arm.diagonal().tail<3>().array() += std::pow(model.arm_sigma.rotation_rad, -2);
  return normal.global - normal.global_arm * normal.arm.llt().solve(normal.global_arm.transpose());
}

Matrix12d prior_information() {
  constexpr double kTranslation_m = 10, kRotation_rad = 3;
  Vector12d diagonal;
  diagonal << Eigen::Vector3d::Constant(1 / (kTranslation_m * kTranslation_m)),
      Eigen::Vector3d::Constant(1 / (kRotation_rad * kRotation_rad)),
      Eigen::Vector3d::Constant(1 / (kTranslation_m * kTranslation_m)),
      Eigen::Vector3d::Constant(1 / (kRotation_rad * kRotation_rad));
  return diagonal.asDiagonal();
}

Matrix6d predicted_covariance(const Matrix12d& information) {
  // Scaled to ones on the diagonal: metres and radians, prior and views differ by ten orders of magnitude.
  const Vector12d scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix12d scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Matrix12d covariance = scale.asDiagonal() * scaled.ldlt().solve(Matrix12d::Identity()) * scale.asDiagonal();
  const Matrix6d hand_eye = covariance.topLeftCorner<6, 6>();
  return (hand_eye + hand_eye.transpose()) / 2;
}

double design_cost(const Matrix6d& covariance, double lever_m) {
  return covariance.topLeftCorner<3, 3>().trace() + lever_m * lever_m * covariance.bottomRightCorner<3, 3>().trace();
}

double design_volume(const Matrix6d& covariance) {
  constexpr double kUnit_m = 1e-3, kUnit_rad = 1e-3;  // of the scaled matrix: keeps its entries near one
  Vector6d scale;
  scale << Eigen::Vector3d::Constant(1 / kUnit_m), Eigen::Vector3d::Constant(1 / kUnit_rad);
  const Matrix6d scaled = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Vector6d pivots = scaled.ldlt().vectorD().cwiseMax(0);
  return kUnit_m * kUnit_rad * std::exp(pivots.array().log().sum() / 6);
}

double predicted_cost(const ViewDesignModel& model, const Matrix12d& information,
                      const Transform<Base, Flange>& candidate, double lever_m) {
  return design_cost(predicted_covariance(information + view_information(model, candidate)), lever_m);
}

}  // namespace firstlook
