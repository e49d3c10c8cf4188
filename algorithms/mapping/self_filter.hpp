/// Which pixels of a depth frame show the arm itself.
#pragma once

#include <span>

#include "algorithms/kinematics/arm_model.hpp"
#include "platform/core/camera_intrinsics.hpp"

namespace firstlook {

/// For each pixel the depth (along the optical axis, m) at which the padded body begins; infinity where it does not.
/// A measured depth at or beyond it belongs to the body or to what it hides; one in front of it is somebody else.
/// A capsule whose padding holds the sensor is taken without padding; one that holds it even so (its own housing) is
/// left out. Distortion is ignored: the padding must cover it.
/// @param body_in_base  capsules in base coordinates (place())
/// @param near_depth_m  width * height values, row-major
void render_self_depth(std::span<const Capsule> body_in_base, double padding_m,
                       const Transform<Base, Depth>& base_T_depth, const CameraIntrinsics& intrinsics,
                       std::span<float> near_depth_m);

}  // namespace firstlook
