/// The plane-to-plane map through matched points.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace firstlook {

/// H with to ~ H from (homogeneous), least squares over four or more matches, coordinates normalised first (Hartley
/// 1997). Empty when the points do not determine it.
[[nodiscard]] std::optional<Eigen::Matrix3d> fit_homography(std::span<const Eigen::Vector2d> from,
                                                            std::span<const Eigen::Vector2d> to);

/// The map of a square with corners (0, 0), (side, 0), (side, side), (0, side) to these four, exactly (Heckbert 1989).
/// Empty when three of them lie on a line.
[[nodiscard]] std::optional<Eigen::Matrix3d> square_to_quad(double side, std::span<const Eigen::Vector2d, 4> quad);

[[nodiscard]] Eigen::Vector2d apply_homography(const Eigen::Matrix3d& h, const Eigen::Vector2d& point);

}  // namespace firstlook
