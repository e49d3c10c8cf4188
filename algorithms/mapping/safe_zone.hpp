/// The space that the operator declares free before anything is seen (safety rule 2).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace firstlook {

/// Upright cylinder about axis 1 of the arm that the operator vouches for. Base frame.
struct SafeZone {
  double radius_m = 0.5;
  double height_m = 1.15;  ///< above `floor_m`
  double floor_m = -0.02;  ///< the cart's own top, z in base

  /// Distance from an inside point to the surface; negative outside (a lower bound of the distance to the outside).
  [[nodiscard]] double depth_m(const Eigen::Vector3d& p) const {
    return std::min({radius_m - std::sqrt(p.x() * p.x() + p.y() * p.y()), floor_m + height_m - p.z(), p.z() - floor_m});
  }
};

}  // namespace firstlook
