/// Poses as UR writes them: x, y, z in metres and a rotation vector in radians.
#pragma once

#include <array>

#include "platform/core/transform.hpp"

namespace firstlook::sim::ur {

using Vector6 = std::array<double, 6>;

[[nodiscard]] Pose pose_of(const Vector6& pose);
/// The rotation vector's length is at most pi.
[[nodiscard]] Vector6 vector_of(const Pose& pose);
[[nodiscard]] Eigen::Vector3d rotation_vector_of(const Eigen::Matrix3d& rotation);

}  // namespace firstlook::sim::ur
