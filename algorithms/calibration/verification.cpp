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

/// Where one view puts its board, and how errors move it: pose_difference of base_T_board by those of the hand-eye
/// transform and of the arm, and the covariance that the corners have.
struct BoardReading {
  int target = 0;
  int station = -1;  ///< as in CalibrationView
  Pose base_T_board = Pose::Identity();
  Matrix6d by_hand_eye = Matrix6d::Zero();
  Matrix6d by_arm = Matrix6d::Zero();
  Matrix6d corner_covariance = Matrix6d::Zero();
};

BoardReading read_board(const SeenView& seen, const HandEyeClaim& claim) {
  const Pose flange = seen.view->base_T_flange.pose();
  const Pose camera = claim.flange_T_camera.pose();
  const Pose board = seen.pose.camera_T_board.pose();
  BoardReading reading;
  reading.target = seen.view->target;
  reading.station = seen.view->station;
  reading.base_T_board = flange * camera * board;
  reading.by_hand_eye = moved_by(flange.linear(), camera.linear() * board.translation());
  reading.by_arm = moved_by(Eigen::Matrix3d::Identity(), reading.base_T_board.translation() - flange.translation());
  const Matrix6d by_camera = moved_by(flange.linear() * camera.linear(), Eigen::Vector3d::Zero());
  reading.corner_covariance =
      claim.corner_sigma_px * claim.corner_sigma_px * by_camera * seen.pose.unit_covariance * by_camera.transpose();
  return reading;
}

/// Inverse of the covariance of all readings together: the calibration's error is common to them, the arm's deviation
/// to those from one place of it.
Eigen::MatrixXd joint_information(const std::vector<BoardReading>& readings, const HandEyeClaim& claim) {
  Vector6d arm_variance;
  arm_variance << Eigen::Vector3d::Constant(claim.arm_sigma.translation_m * claim.arm_sigma.translation_m),
      Eigen::Vector3d::Constant(claim.arm_sigma.rotation_rad * claim.arm_sigma.rotation_rad);
  const auto n = static_cast<Eigen::Index>(readings.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(6 * n, 6 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const BoardReading& a = readings[static_cast<std::size_t>(i)];
    covariance.block<6, 6>(6 * i, 6 * i) += a.corner_covariance;
    for (Eigen::Index j = 0; j < n; ++j) {
      const BoardReading& b = readings[static_cast<std::size_t>(j)];
      covariance.block<6, 6>(6 * i, 6 * j) += a.by_hand_eye * claim.covariance * b.by_hand_eye.transpose();
      if (i != j && (a.station < 0 || a.station != b.station)) continue;
      covariance.block<6, 6>(6 * i, 6 * j) += a.by_arm * arm_variance.asDiagonal() * b.by_arm.transpose();
    }
  }
  return covariance.ldlt().solve(Eigen::MatrixXd::Identity(6 * n, 6 * n));
}

/// The boards behind the readings.
struct CommonBoards {
  std::vector<int> targets;  ///< those that were read, in the order in which they appear
  std::vector<Pose> base_T_board;
  Eigen::MatrixXd covariance;  ///< of all of them
  double chi2 = 0;
};

/// Generalised least squares for the boards behind all readings; three steps reach rounding for what passes.
CommonBoards fit_boards(const std::vector<BoardReading>& readings, const Eigen::MatrixXd& information) {
  const auto n = static_cast<Eigen::Index>(readings.size());
  CommonBoards common;
  std::vector<std::size_t> board;  // of each reading
  for (const BoardReading& reading : readings) {
    const auto known = std::find(common.targets.begin(), common.targets.end(), reading.target);
    board.push_back(static_cast<std::size_t>(known - common.targets.begin()));
    if (known != common.targets.end()) continue;
    common.targets.push_back(reading.target);
    common.base_T_board.push_back(reading.base_T_board);
  }
  const auto boards = static_cast<Eigen::Index>(common.targets.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(6 * n, 6 * boards);
  for (Eigen::Index i = 0; i < n; ++i) {
    design.block<6, 6>(6 * i, 6 * static_cast<Eigen::Index>(board[static_cast<std::size_t>(i)])).setIdentity();
  }
  common.covariance = Eigen::MatrixXd(design.transpose() * information * design)
                          .ldlt()
                          .solve(Eigen::MatrixXd::Identity(6 * boards, 6 * boards));
  const auto differences = [&] {
    Eigen::VectorXd d(6 * n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      d.segment<6>(6 * i) = pose_difference(readings[at].base_T_board, common.base_T_board[board[at]]);
    }
    return d;
  };
  for (int step = 0; step < 3; ++step) {
    const Eigen::VectorXd move = common.covariance * (design.transpose() * (information * differences()));
    for (std::size_t k = 0; k < common.base_T_board.size(); ++k) {
      common.base_T_board[k] = perturb(common.base_T_board[k], move.segment<6>(6 * static_cast<Eigen::Index>(k)));
    }
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

/// The places of the arm, each with its views.
std::vector<std::vector<const SeenView*>> by_station(std::span<const SeenView> seen) {
  std::vector<std::vector<const SeenView*>> stations;
  for (const SeenView& s : seen) {
    const auto same = [&](const auto& station) {
      return s.view->station >= 0 && station.front()->view->station == s.view->station;
    };
    const auto known = std::find_if(stations.begin(), stations.end(), same);
    if (known == stations.end()) {
      stations.push_back({&s});
    } else {
      known->push_back(&s);
    }
  }
  return stations;
}

Matrix6d covariance_by_views(const CameraIntrinsics& camera, const Targets& targets, std::span<const SeenView> seen,
                             const HandEyeClaim& claim, const CommonBoards& common) {
  std::vector<ViewDesignModel> models;
  for (std::size_t k = 0; k < common.targets.size(); ++k) {
    models.push_back({camera, targets[common.targets[k]], claim.flange_T_camera,
                      Transform<Base, Board>(common.base_T_board[k]), claim.corner_sigma_px, claim.arm_sigma});
  }
  Eigen::MatrixXd information = joint_prior_information(models.size());
  for (const auto& station : by_station(seen)) {
    std::uint32_t shown = 0;
    for (const SeenView* s : station) {
      const auto k = std::find(common.targets.begin(), common.targets.end(), s->view->target) - common.targets.begin();
      shown |= 1U << k;
    }
    information += joint_view_information(models, shown, station.front()->view->base_T_flange);
  }
  return predicted_hand_eye(information);
}

void measure_views(const CameraIntrinsics& camera, const Targets& targets, std::span<const SeenView> seen,
                   const HandEyeClaim& claim, Verification& result) {
  double squared_px = 0, squared_m = 0;
  for (const SeenView& s : seen) {
    const auto read = s.view->base_T_flange * claim.flange_T_camera * s.pose.camera_T_board;
    const BoardSpec& board = targets[s.view->target];
    const auto& base_T_board = result.targets[static_cast<std::size_t>(s.view->target)].base_T_board;
    VerifiedView view;
    view.residual_rms_px = reprojection_rms(camera, board, {s.view, 1}, claim.flange_T_camera, base_T_board);
    view.board_shift_m = (read * board.center() - base_T_board * board.center()).norm();
    view.board_turn_rad = rotation_log(read.rotation() * base_T_board.rotation().transpose()).norm();
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
std::vector<SeenView> settled_views(const CameraIntrinsics& camera, const Targets& targets,
                                    std::span<const CalibrationView> views,
                                    const Transform<Flange, Camera>& flange_T_camera) {
  std::vector<SeenView> seen;
  std::vector<OpenView> open;
  for (const CalibrationView& view : views) {
    if (!targets.has(view.target)) continue;
    const auto pose = estimate_board_pose_robust(camera, targets[view.target], view.points());
    if (!pose) continue;
    seen.push_back({&view, pose->pose});
    open.push_back(seen_one_way(view, pose->pose));
  }
  const auto choices = settle_choices(open, flange_T_camera);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    adopt_choice(targets[seen[i].view->target], open[i].choices[choices[i]], seen[i].pose);
  }
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

Result<Verification> verify_hand_eye(const CameraIntrinsics& camera, const Targets& targets,
                                     std::span<const CalibrationView> views, const HandEyeClaim& stated,
                                     const VerificationLimits& limits) {
  const std::vector<SeenView> seen = settled_views(camera, targets, views, stated.flange_T_camera);
  const auto count = static_cast<int>(by_station(seen).size());
  if (count < std::max(2, limits.views_min)) {
    return failure(Fault::kTooFewViews, "{} usable views of the board, {} are the least", count, limits.views_min);
  }
  HandEyeClaim claim = stated;
  claim.corner_sigma_px = std::max(stated.corner_sigma_px, shown_corner_sigma(seen));
  std::vector<BoardReading> readings;
  for (const SeenView& s : seen) readings.push_back(read_board(s, claim));
  const CommonBoards common = fit_boards(readings, joint_information(readings, claim));
  // What the views leave, as so many views of one target would.
  const auto alike = static_cast<int>(readings.size() + 1 - common.targets.size());
  if (alike < 2) return failure(Fault::kTooFewViews, "each target was seen once: two views of one are the least");

  Verification result;
  result.corner_sigma_px = claim.corner_sigma_px;
  result.chi2 = common.chi2;
  result.degrees_of_freedom = 6 * (alike - 1);
  result.chi2_limit = chi_square_quantile(1 - limits.significance, result.degrees_of_freedom);
  result.targets.resize(static_cast<std::size_t>(targets.size()));
  bool finite = std::isfinite(result.chi2) && common.covariance.allFinite();
  for (std::size_t k = 0; k < common.targets.size(); ++k) {
    const auto at = 6 * static_cast<Eigen::Index>(k);
    TargetPose& target = result.targets[static_cast<std::size_t>(common.targets[k])];
    target.views = static_cast<int>(
        std::ranges::count_if(seen, [&](const SeenView& s) { return s.view->target == common.targets[k]; }));
    target.base_T_board = Transform<Base, Board>(common.base_T_board[k]);
    target.covariance = common.covariance.block<6, 6>(at, at);
    finite = finite && common.base_T_board[k].matrix().allFinite();
  }
  if (!finite) {
    return failure(Fault::kSolveFailed, "poses, corners or covariance are not finite");
  }
  result.detectable =
      detectable_error(covariance_by_views(camera, targets, seen, claim, common), claim.covariance, alike, limits);
  measure_views(camera, targets, seen, claim, result);
  judge(limits, result);
  return result;
}

}  // namespace firstlook
