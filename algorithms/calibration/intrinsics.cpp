/// The adapter to OpenCV's camera calibration: its types and exceptions end here.
#include "algorithms/calibration/intrinsics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "algorithms/calibration/intrinsics_prior.hpp"
#include "algorithms/vision/board_pose.hpp"
#include "algorithms/vision/camera_model.hpp"

namespace firstlook {
namespace {

/// RMS angle between the normals of the boards and their mean, as a usual lens would show them: views whose boards are
/// parallel in the camera, such as those that look straight at one, tell no more of it than one of them, and what is
/// estimated from them fits with any tilt.
double normals_spread_rad(int width, int height, const Targets& targets, std::span<const CalibrationView> views) {
  const double focal_px = std::max(width, height);  // 53 degrees across
  const CameraIntrinsics usual{width, height, focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0};
  std::vector<Eigen::Vector3d> normals;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const CalibrationView& view : views) {
    const auto pose = estimate_board_pose(usual, targets[view.target], view.points());
    if (!pose) continue;
    normals.push_back(pose->camera_T_board.rotation().col(2));
    mean += normals.back();
  }
  mean.normalize();
  double squared = 0;
  for (const Eigen::Vector3d& n : normals) squared += std::pow(std::acos(std::clamp(n.dot(mean), -1.0, 1.0)), 2);
  return normals.empty() ? 0 : std::sqrt(squared / static_cast<double>(normals.size()));
}

IntrinsicsEstimate calibrate(int width, int height, const Targets& targets, std::span<const CalibrationView> views) {
  std::vector<std::vector<cv::Point3f>> objects;
  std::vector<std::vector<cv::Point2f>> images;
  for (const CalibrationView& view : views) {
    auto& object = objects.emplace_back();
    auto& image = images.emplace_back();
    for (std::size_t i = 0; i < view.corners_px.size(); ++i) {
      const Eigen::Vector3f p = targets[view.target].corner(point_of(view.ids, i)).cast<float>();
      const Eigen::Vector2f px = view.corners_px[i].cast<float>();
      object.emplace_back(p.x(), p.y(), p.z());
      image.emplace_back(px.x(), px.y());
    }
  }
  cv::Mat matrix, distortion, deviations, deviations_of_poses, view_errors;
  std::vector<cv::Mat> rotations, translations;
  IntrinsicsEstimate estimate;
  estimate.reprojection_rms_px =
      cv::calibrateCamera(objects, images, cv::Size(width, height), matrix, distortion, rotations, translations,
                          deviations, deviations_of_poses, view_errors, cv::CALIB_FIX_K3);
  CameraIntrinsics& c = estimate.camera;
  c.width = width;
  c.height = height;
  c.fx = matrix.at<double>(0, 0);
  c.fy = matrix.at<double>(1, 1);
  c.cx = matrix.at<double>(0, 2);
  c.cy = matrix.at<double>(1, 2);
  c.k1 = distortion.at<double>(0);
  c.k2 = distortion.at<double>(1);
  c.p1 = distortion.at<double>(2);
  c.p2 = distortion.at<double>(3);
  for (int i = 0; i < 8; ++i) estimate.sigma[i] = deviations.at<double>(i);
  return estimate;
}

}  // namespace

Result<IntrinsicsEstimate> estimate_intrinsics(int width, int height, const Targets& targets,
                                               std::span<const CalibrationView> views) {
  constexpr std::size_t kViewsMin = 4;
  if (views.size() < kViewsMin) {
    return failure(Fault::kTooFewViews, "{} views, the camera's intrinsics need {}", views.size(), kViewsMin);
  }
  for (const CalibrationView& view : views) {
    if (const Status fine = check_points(targets[view.target], view.points()); !fine)
      return std::unexpected(fine.error());
  }
  constexpr double kSpreadMin_rad = 1.5 * std::numbers::pi / 180;  // noise of 0.1 px alone makes it 0.7 degrees
  const double spread_rad = normals_spread_rad(width, height, targets, views);
  if (spread_rad < kSpreadMin_rad) {
    return failure(
        Fault::kIntrinsicsUnknown,
        "{} views see the board tilted the same way within {:.1f} degrees, as if it were one view: fx, fy, cx "
        "and cy cannot be told",
        views.size(), spread_rad * 180 / std::numbers::pi);
  }
  try {
    cv::setNumThreads(1);
    IntrinsicsEstimate estimate = calibrate(width, height, targets, views);
    if (!is_usable(estimate.camera) || !(estimate.reprojection_rms_px < 5)) {
      return failure(Fault::kSolveFailed,
                     "the camera's intrinsics cannot be told from these views: fx {:.0f}, RMS {:.1f} px",
                     estimate.camera.fx, estimate.reprojection_rms_px);
    }
    constexpr double kShareMax = 0.2;  // where the joint estimate cannot be trusted to find its way from
    const std::string open = estimate.sigma.allFinite()
                                 ? undetermined_intrinsics(estimate.camera, estimate.sigma, kShareMax)
                                 : std::string("focal lengths and centre");
    if (!open.empty()) return failure(Fault::kIntrinsicsUnknown, "{} views do not tell {}", views.size(), open);
    return estimate;
  } catch (const cv::Exception& e) {
    return failure(Fault::kSolveFailed, "the camera's intrinsics cannot be told from these views: {}", e.err);
  } catch (const std::bad_alloc&) {
    return failure(Fault::kOutOfMemory, "camera intrinsics from {} views", views.size());
  }
}

}  // namespace firstlook
