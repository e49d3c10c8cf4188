#include "algorithms/vision/corner_refinement.hpp"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace firstlook {

void refine_corners(GrayImage image, const CornerRefinement& how, std::span<Eigen::Vector2d> points_px) {
  // OpenCV has no read-only header for foreign pixels; nothing writes to it.
  const cv::Mat header(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data));
  std::vector<cv::Point2f> points;
  for (const auto& p : points_px) points.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  cv::cornerSubPix(
      header, points, cv::Size(how.half_window_px, how.half_window_px), cv::Size(-1, -1),
      cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, how.iterations_max, how.step_min_px));
  for (std::size_t i = 0; i < points_px.size(); ++i) points_px[i] = {points[i].x, points[i].y};
}

}  // namespace firstlook
