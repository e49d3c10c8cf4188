/// The arm's capsules as a camera sees them: intersected by formula, only where their outline can be.
#pragma once

#include <Eigen/Geometry>

#include "algorithms/kinematics/arm_model.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/core/transform.hpp"

namespace firstlook::sim {

struct BodyHit {
  double depth_m = 0;                                ///< along the optical axis
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, in the camera frame
};

/// One capsule of a picture.
struct BodyPart {
  Eigen::Vector3d a, b, axis;  ///< the ends and the unit direction from a to b
  double length_m = 0, radius_m = 0;
  Eigen::Vector3d offset;               ///< of the axis from the eye, where it is nearest
  double a_along = 0, eye_outside = 0;  ///< a along the axis; squared distance of the axis less squared radius
  double x_low = 0, x_high = 0, y_low = 0, y_high = 0;  ///< outline in normalised image coordinates
};

/// Capsules in the frame of an eye that looks along z. Those that hold `eye` or `also_outside` are left out: a camera
/// does not see its own housing.
class BodyImage {
 public:
  BodyImage(const Capsules& body, const Pose& base_T_eye, const Eigen::Vector3d& also_outside_m);

  [[nodiscard]] bool empty() const { return parts_.empty(); }
  /// The nearest capsule surface along (x, y, 1) that is nearer than `before_m`; false when there is none.
  [[nodiscard]] bool intersect(double x, double y, double before_m, BodyHit& hit) const;
  /// What of it rays at normalised heights from y_low to y_high can meet.
  [[nodiscard]] BodyImage band(double y_low, double y_high) const;

 private:
  BodyImage() = default;
  void add(const BodyPart& part);

  FixedVector<BodyPart, kCapsulesMax> parts_;
  double x_low_ = 1, x_high_ = 0;  ///< of all their outlines
};

}  // namespace firstlook::sim
