#include "algorithms/calibration/verification.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "algorithms/calibration/board_ambiguity.hpp"
#include "algorithms/calibration/chi_square.hpp"
#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/calibration/moved_by.hpp"
#include "algorithms/calibration/verdict.hpp"
#include "algorithms/calibration/view_design.hpp"
#include "algorithms/vision/board_pose.hpp"

namespace firstlook {
namespace {

/// A view with the board's pose in the camera.
struct SeenView {
  const CalibrationView* view;
  BoardPose pose;
};

/// Where one view puts the board, and how errors move it: pose_difference of base_T_board by those of the hand-eye
/// transform, and the covariance that the view has for itself (arm and corners).
struct BoardReading {
  Pose base_T_board = Pose::Identity();
  Matrix6d by_hand_eye = Matrix6d::Zero();
  Matrix6d own_covariance = Matrix6d::Zero();
};

BoardReading read_board(const SeenView& seen, const HandEyeClaim& claim) {
  const Pose flange = seen.view->base_T_flange.pose();
  const Pose camera = claim.flange_T_camera.pose();
  const Pose board = seen.pose.camera_T_board.pose();
  BoardReading reading;
  reading.base_T_board = flange * camera * board;
  reading.by_hand_eye = moved_by(flange.linear(), camera.linear() * board.translation());
  const Matrix6d by_arm =
      moved_by(Eigen::Matrix3d::Identity(), reading.base_T_board.translation() - flange.translation());
  const Matrix6d by_camera = moved_by(flange.linear() * camera.linear(), Eigen::Vector3d::Zero());
  Vector6d arm_variance;
  arm_variance << Eigen::Vector3d::Constant(claim.arm_sigma.translation_m * claim.arm_sigma.translation_m),
      Eigen::Vector3d::Constant(claim.arm_sigma.rotation_rad * claim.arm_sigma.rotation_rad);
  reading.own_covariance =
      by_arm * arm_variance.asDiagonal() * by_arm.transpose() +
      claim.corner_sigma_px * claim.corner_sigma_px * by_camera * seen.pose.unit_covariance * by_camera.transpose();
  return reading;
}

/// Inverse of the covariance of all readings together: the calibration's error is common to them.
Eigen::MatrixXd joint_information(const std::vector<BoardReading>& readings, const Matrix6d& claim_covariance) {
  const auto n = static_cast<Eigen::Index>(readings.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(6 * n, 6 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const BoardReading& a = readings[static_cast<std::size_t>(i)];
    covariance.block<6, 6>(6 * i, 6 * i) += a.own_covariance;
    for (Eigen::Index j = 0; j < n; ++j) {
      const BoardReading& b = readings[static_cast<std::size_t>(j)];
      covariance.block<6, 6>(6 * i, 6 * j) += a.by_hand_eye * claim_covariance * b.by_hand_eye.transpose();
    }
  }
  return covariance.ldlt().solve(Eigen::MatrixXd::Identity(6 * n, 6 * n));
}

struct CommonBoard {
  Pose base_T_board = Pose::Identity();
  Matrix6d covariance = Matrix6d::Zero();
  double chi2 = 0;
};

/// Generalised least squares for the one board behind all readings; three steps reach rounding for what passes.
CommonBoard fit_board(const std::vector<BoardReading>& readings, const Eigen::MatrixXd& information) {
  const auto n = static_cast<Eigen::Index>(readings.size());
  const Eigen::MatrixXd design = Matrix6d::Identity().replicate(n, 1);
  CommonBoard common;
  common.base_T_board = readings.front().base_T_board;
  common.covariance = Matrix6d(design.transpose() * information * design).ldlt().solve(Matrix6d::Identity());
  const auto differences = [&] {
    Eigen::VectorXd d(6 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Pose& read = readings[static_cast<std::size_t>(i)].base_T_board;
      d.segment<6>(6 * i) = pose_difference(read, common.base_T_board);
    }
    return d;
  };
  for (int step = 0; step < 3; ++step) {
    const Vector6d move = common.covariance * (design.transpose() * (information * differences()));
    common.base_T_board = perturb(common.base_T_board, move);
  }
  const Eigen::VectorXd rest = differences();
  common.chi2 = rest.dot(information * rest);
  return common;
}

/// Noise of a corner, from what is left when each view has its own pose of the board (six parameters).
double shown_corner_sigma(std::span<const SeenView> seen) {
  double squared_px = 0, corners = 0;
  for (const SeenView& s : seen) {
    squared_px += s.pose.residual_rms_px * s.pose.residual_rms_px;
    corners += static_cast<double>(s.view->corners_px.size());
  }
  const double coordinates = 2 * corners / static_cast<double>(seen.size());
  return std::sqrt(squared_px / static_cast<double>(seen.size()) * coordinates / (coordinates - 6));
}

Matrix6d covariance_by_views(const CameraIntrinsics& camera, const BoardSpec& board, std::span<const SeenView> seen,
                             const HandEyeClaim& claim, const Transform<Base, Board>& base_T_board) {
  const ViewDesignModel model{camera,         board, claim.flange_T_camera, base_T_board, claim.corner_sigma_px,
                              claim.arm_sigma};
  Matrix12d information = prior_information();
  for (const SeenView& s : seen) information += view_information(model, s.view->base_T_flange);
  return predicted_covariance(information);
}

void measure_views(const CameraIntrinsics& camera, const BoardSpec& board, std::span<const SeenView> seen,
                   const HandEyeClaim& claim, Verification& result) {
  double squared_px = 0, squared_m = 0;
  for (const SeenView& s : seen) {
    const auto read = s.view->base_T_flange * claim.flange_T_camera * s.pose.camera_T_board;
    VerifiedView view;
    view.residual_rms_px = reprojection_rms(camera, board, {s.view, 1}, claim.flange_T_camera, result.base_T_board);
    view.board_shift_m = (read * board.center() - result.base_T_board * board.center()).norm();
    view.board_turn_rad = rotation_log(read.rotation() * result.base_T_board.rotation().transpose()).norm();
    squared_px += view.residual_rms_px * view.residual_rms_px;
    squared_m += view.board_shift_m * view.board_shift_m;
    result.views.push_back(view);
  }
  const auto n = static_cast<double>(seen.size());
  result.residual_rms_px = std::sqrt(squared_px / n);
  result.residual_rms_m = std::sqrt(squared_m / n);
}

void judge(const VerificationLimits& limits, Verification& result) {
  if (!(result.chi2 <= result.chi2_limit)) {
    const auto worst = std::max_element(
        result.views.begin(), result.views.end(),
        [](const VerifiedView& a, const VerifiedView& b) { return a.board_shift_m < b.board_shift_m; });
    result.reasons.push_back(
        fmt::format("the views put the board at different places: chi-square {:.1f} with {} degrees of freedom, "
                    "allowed {:.1f} (one right calibration in {:.0f} exceeds it)",
                    result.chi2, result.degrees_of_freedom, result.chi2_limit, 1 / limits.significance));
    result.reasons.push_back(
        fmt::format("view {} sees the board {:.1f} mm and {:.1f} mrad from where all views "
                    "together put it, {:.2f} px RMS",
                    worst - result.views.begin() + 1, worst->board_shift_m * 1e3, worst->board_turn_rad * 1e3,
                    worst->residual_rms_px));
  }
  const auto too_large = [&](double value, double limit, double to_text, const char* unit) {
    if (value <= limit) return;
    result.reasons.push_back(
        fmt::format("the views are too much alike to test it: they would miss an error of {:.3g} "
                    "{}, allowed {:.3g} {}",
                    value * to_text, unit, limit * to_text, unit));
  };
  too_large(result.detectable.translation_m, limits.detectable_max_m, 1e3, "mm");
  too_large(result.detectable.rotation_rad, limits.detectable_max_rad, 1e3, "mrad");
  result.holds = result.reasons.empty();
}

double largest_deviation(const Eigen::Matrix3d& covariance) {
  return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues()(2)));
}

/// The views that show a board, each with the one of its poses that agrees with the others.
std::vector<SeenView> settled_views(const CameraIntrinsics& camera, const BoardSpec& board,
                                    std::span<const CalibrationView> views,
                                    const Transform<Flange, Camera>& flange_T_camera) {
  std::vector<SeenView> seen;
  std::vector<OpenView> open;
  for (const CalibrationView& view : views) {
    const auto pose = estimate_board_pose_robust(camera, board, view.points());
    if (!pose) continue;
    seen.push_back({&view, pose->pose});
    open.push_back(seen_one_way(view, pose->pose));
  }
  const auto choices = settle_choices(open, flange_T_camera);
  for (std::size_t i = 0; i < seen.size(); ++i) adopt_choice(board, open[i].choices[choices[i]], seen[i].pose);
  return seen;
}

}  // namespace

DetectableError detectable_error(const Matrix6d& views_covariance, const Matrix6d& claim_covariance, int views,
                                 const VerificationLimits& limits) {
  // An error e shifts the statistic's mean by e^T (P + S)^-1 e, P what the views alone tell, S what the calibration
  // allows itself. Least over all rotations that may come with a translation t: t^T [(P + S)_tt]^-1 t.
  if (views < 2) return {1e3, 1e3};  // one view shows nothing of the hand-eye transform
  const double root = std::sqrt(detectable_noncentrality(6 * (views - 1), limits.significance, limits.power));
  const Matrix6d sum = views_covariance + claim_covariance;
  return {root * largest_deviation(sum.topLeftCorner<3, 3>()), root * largest_deviation(sum.bottomRightCorner<3, 3>())};
}

Result<Verification> verify_hand_eye(const CameraIntrinsics& camera, const BoardSpec& board,
                                     std::span<const CalibrationView> views, const HandEyeClaim& stated,
                                     const VerificationLimits& limits) {
  const std::vector<SeenView> seen = settled_views(camera, board, views, stated.flange_T_camera);
  const auto count = static_cast<int>(seen.size());
  if (count < std::max(2, limits.views_min)) {
    return failure(Fault::kTooFewViews, "{} usable views of the board, {} are the least", count, limits.views_min);
  }
  HandEyeClaim claim = stated;
  claim.corner_sigma_px = std::max(stated.corner_sigma_px, shown_corner_sigma(seen));
  std::vector<BoardReading> readings;
  for (const SeenView& s : seen) readings.push_back(read_board(s, claim));
  const CommonBoard common = fit_board(readings, joint_information(readings, claim.covariance));

  Verification result;
  result.corner_sigma_px = claim.corner_sigma_px;
  result.chi2 = common.chi2;
  result.degrees_of_freedom = 6 * (count - 1);
  result.chi2_limit = chi_square_quantile(1 - limits.significance, result.degrees_of_freedom);
  result.base_T_board = Transform<Base, Board>(common.base_T_board);
  result.board_covariance = common.covariance;
  if (!std::isfinite(result.chi2) || !common.covariance.allFinite() || !common.base_T_board.matrix().allFinite()) {
    return failure(Fault::kSolveFailed, "poses, corners or covariance are not finite");
  }
  result.detectable = detectable_error(covariance_by_views(camera, board, seen, claim, result.base_T_board),
                                       claim.covariance, count, limits);
  measure_views(camera, board, seen, claim, result);
  judge(limits, result);
  return result;
}

}  // namespace firstlook
