#include "algorithms/calibration/reprojection_terms.hpp"

namespace firstlook {

std::optional<CornerTerm> corner_term(const CameraIntrinsics& camera, const ViewGeometry& geometry,
                                      const Eigen::Vector3d& corner_in_board) {
  const Eigen::Vector3d turned = geometry.base_T_board.linear() * corner_in_board;
  const Eigen::Vector3d from_flange =
      turned + geometry.base_T_board.translation() - geometry.base_T_flange.translation();
  const Eigen::Vector3d from_camera =
      geometry.base_T_flange.linear().transpose() * from_flange - geometry.flange_T_camera.translation();
  const Eigen::Matrix3d camera_R_flange = geometry.flange_T_camera.linear().transpose();
  const auto projected = project_with_jacobian(camera, camera_R_flange * from_camera);
  if (!projected) return std::nullopt;
  const Eigen::Matrix<double, 2, 3> by_flange = projected->d_pixel_d_point * camera_R_flange;
  const Eigen::Matrix<double, 2, 3> by_base = by_flange * geometry.base_T_flange.linear().transpose();
  CornerTerm term;
  term.pixel = projected->pixel;
  term.normalized = projected->normalized;
  term.d_hand_eye << -by_flange, by_flange * cross_matrix(from_camera);
  term.d_board << by_base, -by_base * cross_matrix(turned);
  term.d_arm << -by_base, by_base * cross_matrix(from_flange);
  return term;
}

void ViewNormal::add(const CornerTerm& term, const Eigen::Vector2d& residual, double weight) {
  Eigen::Matrix<double, 2, 12> j;
  j << term.d_hand_eye, term.d_board;
  // Lazy: two rows are no work for Eigen's blocked kernels, which take this size otherwise.
  global += weight * j.transpose().lazyProduct(j);
  global_arm.noalias() += weight * j.transpose() * term.d_arm;
  arm.noalias() += weight * term.d_arm.transpose() * term.d_arm;
  global_right.noalias() += weight * j.transpose() * residual;
  arm_right.noalias() += weight * term.d_arm.transpose() * residual;
}

void IntrinsicsNormal::add(const CornerTerm& term, const IntrinsicsJacobian& by_intrinsics,
                           const Eigen::Vector2d& residual, double weight) {
  const Eigen::Matrix<double, 9, 2> weighted = weight * by_intrinsics.transpose();
  global.topRows<6>().noalias() += term.d_hand_eye.transpose() * weighted.transpose();
  global.bottomRows<6>().noalias() += term.d_board.transpose() * weighted.transpose();
  arm.noalias() += weighted * term.d_arm;
  own.noalias() += weighted * by_intrinsics;
  right.noalias() += weighted * residual;
}

}  // namespace firstlook
