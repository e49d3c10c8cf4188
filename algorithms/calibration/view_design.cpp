#include "algorithms/calibration/view_design.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

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

/// Of a view before the arm's deviation is marginalised; empty when a corner lies behind the camera.
std::optional<ViewNormal> view_normal(const ViewDesignModel& model, const Transform<Base, Flange>& base_T_flange) {
  const ViewGeometry geometry{model.flange_T_camera.pose(), model.base_T_board.pose(), base_T_flange.pose()};
  const double weight = 1 / (model.corner_sigma_px * model.corner_sigma_px);
  ViewNormal normal;
  for (int i = 0; i < model.board.corners(); ++i) {
    const auto term = corner_term(model.camera, geometry, model.board.corner(i));
    if (!term) return std::nullopt;
    normal.add(*term, Eigen::Vector2d::Zero(), weight);
  }
  return normal;
}

void believe_arm(const ArmSigma& sigma, Matrix6d& arm) {
  arm.diagonal().head<3>().array() += std::pow(sigma.translation_m, -2);
  arm.diagonal().tail<3>().array() += std::pow(sigma.rotation_rad, -2);
}

bool is_shown(std::uint32_t shown, std::size_t target) { return (shown >> target & 1U) != 0; }

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
  auto normal = view_normal(model, base_T_flange);
  if (!normal) return Matrix12d::Zero();
  believe_arm(model.arm_sigma, normal->arm);
  return normal->global - normal->global_arm * normal->arm.llt().solve(normal->global_arm.transpose());
}

Eigen::MatrixXd joint_view_information(std::span<const ViewDesignModel> models, std::uint32_t shown,
                                       const Transform<Base, Flange>& base_T_flange) {
  if (models.size() == 1 && is_shown(shown, 0)) return view_information(models.front(), base_T_flange);
  const auto size = static_cast<Eigen::Index>(6 + 6 * models.size());
  Eigen::MatrixXd global = Eigen::MatrixXd::Zero(size, size), global_arm = Eigen::MatrixXd::Zero(size, 6);
  Matrix6d arm = Matrix6d::Zero();
  for (std::size_t k = 0; k < models.size(); ++k) {
    if (!is_shown(shown, k)) continue;
    const auto normal = view_normal(models[k], base_T_flange);
    if (!normal) continue;
    const auto at = static_cast<Eigen::Index>(6 + 6 * k);
    global.topLeftCorner<6, 6>() += normal->global.topLeftCorner<6, 6>();
    global.block<6, 6>(0, at) += normal->global.topRightCorner<6, 6>();
    global.block<6, 6>(at, 0) += normal->global.bottomLeftCorner<6, 6>();
    global.block<6, 6>(at, at) += normal->global.bottomRightCorner<6, 6>();
    global_arm.topRows<6>() += normal->global_arm.topRows<6>();
    global_arm.middleRows<6>(at) += normal->global_arm.bottomRows<6>();
    arm += normal->arm;
  }
  believe_arm(models.front().arm_sigma, arm);
  return global - global_arm * arm.llt().solve(Eigen::MatrixXd(global_arm.transpose()));
}

Eigen::MatrixXd joint_prior_information(std::size_t targets) {
  const Matrix12d one = prior_information();
  const auto size = static_cast<Eigen::Index>(6 + 6 * targets);
  Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index i = 0; i < size; ++i) prior(i, i) = one(i % 6, i % 6);  // the same for transform and board
  return prior;
}

Eigen::MatrixXd predicted_joint(const Eigen::MatrixXd& information) {
  const Eigen::VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::MatrixXd inverse = scaled.ldlt().solve(Eigen::MatrixXd::Identity(scaled.rows(), scaled.cols()));
  const Eigen::MatrixXd covariance = scale.asDiagonal() * inverse * scale.asDiagonal();
  return (covariance + covariance.transpose()) / 2;
}

Matrix6d predicted_hand_eye(const Eigen::MatrixXd& information) {
  if (information.rows() == 12) return predicted_covariance(information);
  return predicted_joint(information).topLeftCorner<6, 6>();
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
