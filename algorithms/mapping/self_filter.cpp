#include "algorithms/mapping/self_filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr double kMiss = std::numeric_limits<double>::infinity();

// A capsule in the sensor's frame.
struct Solid {
  Eigen::Vector3d a;
  Eigen::Vector3d b;
  double radius_m = 0;
};

struct PixelRectangle {
  int column_first = 0, column_last = -1;
  int row_first = 0, row_last = -1;
};

double distance_of_origin(const Solid& solid) {
  const Eigen::Vector3d ab = solid.b - solid.a;
  const double length_squared = ab.squaredNorm();
  const double t = length_squared > 0 ? std::clamp(-solid.a.dot(ab) / length_squared, 0.0, 1.0) : 0.0;
  return (solid.a + t * ab).norm();
}

// Depth at which the ray t * direction enters a sphere.
double enter_sphere(const Eigen::Vector3d& center_m, double radius_m, const Eigen::Vector3d& direction) {
  const double dd = direction.squaredNorm(), dc = direction.dot(center_m);
  const double discriminant = dc * dc - dd * (center_m.squaredNorm() - radius_m * radius_m);
  if (discriminant < 0 || dc <= 0) return kMiss;
  return (dc - std::sqrt(discriminant)) / dd;
}

// Depth at which the ray enters the side of the cylinder between the two spheres.
double enter_side(const Solid& solid, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d ab = solid.b - solid.a;
  const double length_squared = ab.squaredNorm();
  if (length_squared == 0) return kMiss;
  // Across the axis: |t d' - a'|² = r², with d', a' the parts perpendicular to it.
  const Eigen::Vector3d across_d = direction - ab * (direction.dot(ab) / length_squared);
  const Eigen::Vector3d across_a = solid.a - ab * (solid.a.dot(ab) / length_squared);
  const double dd = across_d.squaredNorm(), da = across_d.dot(across_a);
  const double discriminant = da * da - dd * (across_a.squaredNorm() - solid.radius_m * solid.radius_m);
  if (discriminant < 0 || dd == 0) return kMiss;
  const double t = (da - std::sqrt(discriminant)) / dd;
  const double along = (t * direction - solid.a).dot(ab);
  return t > 0 && along >= 0 && along <= length_squared ? t : kMiss;
}

double enter(const Solid& solid, const Eigen::Vector3d& direction) {
  return std::min({enter_sphere(solid.a, solid.radius_m, direction), enter_sphere(solid.b, solid.radius_m, direction),
                   enter_side(solid, direction)});
}

// A segment in the plane of the optical axis and one image axis.
struct PlanarSegment {
  Eigen::Vector2d a;  // across, along the optical axis
  Eigen::Vector2d b;
};

double distance_of_origin(const PlanarSegment& s) {
  const Eigen::Vector2d ab = s.b - s.a;
  const double length_squared = ab.squaredNorm();
  const double t = length_squared > 0 ? std::clamp(-s.a.dot(ab) / length_squared, 0.0, 1.0) : 0.0;
  return (s.a + t * ab).norm();
}

// The first and last pixel along one image axis whose centre may show a segment thickened by a radius: the hull of the
// angles under which its two ends appear, cut to what is in front of the sensor.
void to_pixels(const PlanarSegment& s, double radius_m, double f, double c, int size, int& first, int& last) {
  constexpr double kTurn_rad = 6.283185307179586;
  constexpr double kAhead_rad = 1.5707;  // a hair less than a quarter turn: its tangent is beyond any image
  first = 0;
  last = size - 1;
  if (distance_of_origin(s) <= radius_m) return;  // all around
  const double a_rad = std::atan2(s.a.x(), s.a.y());
  const double b_rad = a_rad + std::remainder(std::atan2(s.b.x(), s.b.y()) - a_rad, kTurn_rad);
  const double a_half_rad = std::asin(radius_m / s.a.norm()), b_half_rad = std::asin(radius_m / s.b.norm());
  const double low_rad = std::min(a_rad - a_half_rad, b_rad - b_half_rad);
  const double high_rad = std::max(a_rad + a_half_rad, b_rad + b_half_rad);
  double low_px = size, high_px = -1;
  for (const double turn_rad : {-kTurn_rad, 0.0, kTurn_rad}) {
    const double from_rad = std::max(low_rad + turn_rad, -kAhead_rad),
                 to_rad = std::min(high_rad + turn_rad, kAhead_rad);
    if (from_rad > to_rad) continue;
    low_px = std::min(low_px, std::tan(from_rad) * f + c);
    high_px = std::max(high_px, std::tan(to_rad) * f + c);
  }
  first = static_cast<int>(std::ceil(std::clamp(low_px, 0.0, static_cast<double>(size))));
  last = static_cast<int>(std::floor(std::clamp(high_px, -1.0, size - 1.0)));
}

PixelRectangle bounding_rectangle(const Solid& solid, const CameraIntrinsics& c) {
  PixelRectangle r;
  if (std::max(solid.a.z(), solid.b.z()) + solid.radius_m <= 0) return r;
  const PlanarSegment across{{solid.a.x(), solid.a.z()}, {solid.b.x(), solid.b.z()}};
  const PlanarSegment down{{solid.a.y(), solid.a.z()}, {solid.b.y(), solid.b.z()}};
  to_pixels(across, solid.radius_m, c.fx, c.cx, c.width, r.column_first, r.column_last);
  to_pixels(down, solid.radius_m, c.fy, c.cy, c.height, r.row_first, r.row_last);
  return r;
}

void render(const Solid& solid, const CameraIntrinsics& c, std::span<float> near_depth_m) {
  const PixelRectangle r = bounding_rectangle(solid, c);
  for (int row = r.row_first; row <= r.row_last; ++row) {
    for (int column = r.column_first; column <= r.column_last; ++column) {
      const double depth_m = enter(solid, {(column - c.cx) / c.fx, (row - c.cy) / c.fy, 1.0});
      float& near_m = near_depth_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(c.width) +
                                   static_cast<std::size_t>(column)];
      near_m = std::min(near_m, static_cast<float>(depth_m));
    }
  }
}

}  // namespace

void render_self_depth(std::span<const Capsule> body_in_base, double padding_m,
                       const Transform<Base, Depth>& base_T_depth, const CameraIntrinsics& intrinsics,
                       std::span<float> near_depth_m) {
  ENSURE(3041, intrinsics.width > 0 && intrinsics.height > 0 && intrinsics.fx > 0 && intrinsics.fy > 0);
  ENSURE(3042, near_depth_m.size() ==
                   static_cast<std::size_t>(intrinsics.width) * static_cast<std::size_t>(intrinsics.height));
  std::fill(near_depth_m.begin(), near_depth_m.end(), std::numeric_limits<float>::infinity());
  const Transform<Depth, Base> depth_T_base = base_T_depth.inverse();
  for (const Capsule& capsule : body_in_base) {
    Solid solid{depth_T_base * capsule.a, depth_T_base * capsule.b, capsule.radius_m + padding_m};
    if (distance_of_origin(solid) <= solid.radius_m) solid.radius_m = capsule.radius_m;
    if (distance_of_origin(solid) <= solid.radius_m) continue;
    render(solid, intrinsics, near_depth_m);
  }
}

}  // namespace firstlook
