/// The adapter to OpenCV's camera calibration: its types and exceptions end here.
#include "algorithms/calibration/intrinsics.hpp"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "algorithms/vision/camera_model.hpp"

namespace firstlook {
namespace {

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
  cv::Mat matrix, distortion;
  std::vector<cv::Mat> rotations, translations;
  IntrinsicsEstimate estimate;
  estimate.reprojection_rms_px = cv::calibrateCamera(objects, images, cv::Size(width, height), matrix, distortion,
                                                     rotations, translations, cv::CALIB_FIX_K3);
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
  try {
    cv::setNumThreads(1);
    const IntrinsicsEstimate estimate = calibrate(width, height, targets, views);
    if (!is_usable(estimate.camera) || !(estimate.reprojection_rms_px < 5)) {
      return failure(Fault::kSolveFailed,
                     "the camera's intrinsics cannot be told from these views: fx {:.0f}, RMS {:.1f} px",
                     estimate.camera.fx, estimate.reprojection_rms_px);
    }
    return estimate;
  } catch (const cv::Exception& e) {
    return failure(Fault::kSolveFailed, "the camera's intrinsics cannot be told from these views: {}", e.err);
  } catch (const std::bad_alloc&) {
    return failure(Fault::kOutOfMemory, "camera intrinsics from {} views", views.size());
  }
}

}  // namespace firstlook
