#include "algorithms/calibration/intrinsics_misfit.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>

#include "algorithms/calibration/chi_square.hpp"

namespace firstlook {
namespace {

constexpr double kRight = 0.999;  // share of right sets that pass each test
constexpr int kStationsMin = 8;   // fewer hardly tell eight intrinsics from the rest

/// Sum of squares that a difference amounts to under a covariance.
double normalized(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance) {
  return difference.dot(covariance.ldlt().solve(difference));
}

}  // namespace

std::string intrinsics_misfit(const CameraIntrinsics& given, const Targets& targets,
                              std::span<const CalibrationView> views, const RefinementOptions& options,
                              const SolvedHandEye& solved) {
  RefinementOptions joint = options;
  joint.intrinsics = EstimatedIntrinsics::kWithoutK3;
  joint.intrinsics_prior.reset();
  const auto fit = refine_hand_eye(given, targets, views, solved.flange_T_camera, joint);
  if (!fit || fit->views_used < kStationsMin) return {};
  const int count = fit->intrinsics->count;
  const Eigen::VectorXd step = (intrinsics_vector(fit->camera) - intrinsics_vector(given)).head(count);
  const Vector6d moved = pose_difference(fit->flange_T_camera.pose(), solved.flange_T_camera.pose());
  const double astray = normalized(moved, solved.covariance);
  if (!(normalized(step, fit->intrinsics->covariance.topLeftCorner(count, count)) >
        chi_square_quantile(kRight, count)) ||
      !(astray > chi_square_quantile(kRight, 6))) {
    return {};
  }
  const CameraIntrinsics& seen = fit->camera;
  const IntrinsicsVector sigma = fit->intrinsics->sigma();
  return fmt::format(
      "the intrinsics do not fit these views, which say fx {:.2f} fy {:.2f} cx {:.2f} cy {:.2f} px (sigma {:.2f} "
      "{:.2f} "
      "{:.2f} {:.2f}), given are {:.2f} {:.2f} {:.2f} {:.2f}; with those seen the camera sits {:.2f} mm and {:.2f} "
      "mrad "
      "elsewhere, {:.0f} times what the covariance allows for: have them estimated, or give those of this camera",
      seen.fx, seen.fy, seen.cx, seen.cy, sigma[0], sigma[1], sigma[2], sigma[3], given.fx, given.fy, given.cx,
      given.cy, moved.head<3>().norm() * 1e3, moved.tail<3>().norm() * 1e3, std::sqrt(astray / 6));
}

}  // namespace firstlook
