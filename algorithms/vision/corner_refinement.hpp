/// Moves a rough corner to where the edges around it meet.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "platform/core/image_view.hpp"

namespace firstlook {

struct CornerRefinement {
  int half_window_px = 5;
  int iterations_max = 40;
  double step_min_px = 0.001;
};

/// Moves each point to the spot that all grey gradients of its window are perpendicular to (Foerstner 1987, by OpenCV's
/// cornerSubPix), in place. The image must be larger than the window. Throws cv::Exception: for the adapters.
void refine_corners(GrayImage image, const CornerRefinement& how, std::span<Eigen::Vector2d> points_px);

}  // namespace firstlook
