#include "hal/sim/body_image.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/kinematics/self_collision.hpp"

namespace firstlook::sim {
namespace {

constexpr double kWide = std::numeric_limits<double>::infinity();

/// Range of across / depth over a sphere in front of the eye: the two tangents.
void extend(double across, double depth, double radius, double& low, double& high) {
  const double middle = std::atan2(across, depth);
  const double half = std::asin(std::min(1.0, radius / std::hypot(across, depth)));
  constexpr double kRightAngle = 1.57;
  low = std::min(low, middle - half > -kRightAngle ? std::tan(middle - half) : -kWide);
  high = std::max(high, middle + half < kRightAngle ? std::tan(middle + half) : kWide);
}

/// Where a ray from the origin first meets a sphere, in lengths of d; infinity when it does not.
double sphere(const Eigen::Vector3d& center, double radius, const Eigen::Vector3d& d) {
  const double dd = d.squaredNorm(), b = d.dot(center);
  const double discriminant = b * b - dd * (center.squaredNorm() - radius * radius);
  if (discriminant < 0) return kWide;
  const double t = (b - std::sqrt(discriminant)) / dd;
  return t > 0 ? t : kWide;
}

}  // namespace

BodyImage::BodyImage(const Capsules& body, const Pose& base_T_eye, const Eigen::Vector3d& also_outside_m) {
  const Pose eye_T_base = base_T_eye.inverse(Eigen::Isometry);
  const Eigen::Vector3d eye = Eigen::Vector3d::Zero(), other = eye_T_base * also_outside_m;
  for (const Capsule& capsule : body) {
    const Eigen::Vector3d a = eye_T_base * capsule.a, b = eye_T_base * capsule.b;
    if (segment_distance_m(a, b, eye, eye) <= capsule.radius_m) continue;
    if (segment_distance_m(a, b, other, other) <= capsule.radius_m) continue;
    if (std::max(a.z(), b.z()) + capsule.radius_m <= 0) continue;  // behind
    BodyPart part;
    part.a = a, part.b = b;
    part.length_m = (b - a).norm();
    part.axis = part.length_m > 0 ? Eigen::Vector3d((b - a) / part.length_m) : Eigen::Vector3d::UnitX();
    part.radius_m = capsule.radius_m;
    part.a_along = a.dot(part.axis);
    part.offset = a - part.a_along * part.axis;
    part.eye_outside = part.offset.squaredNorm() - part.radius_m * part.radius_m;
    part.x_low = part.y_low = kWide, part.x_high = part.y_high = -kWide;
    if (std::min(a.z(), b.z()) > capsule.radius_m) {
      // A capsule is the convex hull of its two end spheres, and so is its picture of theirs.
      for (const Eigen::Vector3d& end : {a, b}) {
        extend(end.x(), end.z(), part.radius_m, part.x_low, part.x_high);
        extend(end.y(), end.z(), part.radius_m, part.y_low, part.y_high);
      }
    } else {
      part.x_low = part.y_low = -kWide, part.x_high = part.y_high = kWide;
    }
    add(part);
  }
}

void BodyImage::add(const BodyPart& part) {
  x_low_ = parts_.empty() ? part.x_low : std::min(x_low_, part.x_low);
  x_high_ = parts_.empty() ? part.x_high : std::max(x_high_, part.x_high);
  parts_.push_back(part);
}

BodyImage BodyImage::band(double y_low, double y_high) const {
  BodyImage band;
  for (const BodyPart& part : parts_) {
    if (y_high >= part.y_low && y_low <= part.y_high) band.add(part);
  }
  return band;
}

bool BodyImage::intersect(double x, double y, double before_m, BodyHit& hit) const {
  if (!(x >= x_low_ && x <= x_high_)) return false;
  bool found = false;
  const Eigen::Vector3d d(x, y, 1);
  for (const BodyPart& part : parts_) {
    if (x < part.x_low || x > part.x_high || y < part.y_low || y > part.y_high) continue;
    // The side, a quadratic across the axis; where it ends, the end spheres.
    const double d_along = d.dot(part.axis), aa = d.squaredNorm() - d_along * d_along, bb = d.dot(part.offset);
    const double discriminant = bb * bb - aa * part.eye_outside;
    double t = kWide;
    if (aa > 1e-12) {
      if (discriminant < 0) continue;
      t = (bb - std::sqrt(discriminant)) / aa;
      const double at = t * d_along - part.a_along;
      if (!(t > 0) || at < 0 || at > part.length_m) t = kWide;
    }
    if (t == kWide) t = std::min(sphere(part.a, part.radius_m, d), sphere(part.b, part.radius_m, d));
    if (!(t < before_m)) continue;
    before_m = t;
    found = true;
    const Eigen::Vector3d p = t * d;
    const double along = std::clamp((p - part.a).dot(part.axis), 0.0, part.length_m);
    hit.depth_m = t;
    hit.normal = (p - part.a - along * part.axis) / part.radius_m;
  }
  return found;
}

}  // namespace firstlook::sim
