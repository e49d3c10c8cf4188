/// Grey values between the pixels.
#pragma once

#include <Eigen/Core>
#include <span>

#include "platform/core/image_view.hpp"

namespace firstlook {

/// Grey value between the pixels, bilinear; the border goes on outside. For images of at least 2x2.
[[nodiscard]] double gray_between(GrayImage image, const Eigen::Vector2d& px);

/// The same at many points at once, with the same bits, in less time. `u` and `v` as long as `gray`.
void grays_between(GrayImage image, std::span<const double> u, std::span<const double> v, std::span<double> gray);

}  // namespace firstlook
