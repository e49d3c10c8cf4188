#include "hal/sim/ur_controller/tool_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/ur_controller/rotation_vector.hpp"

namespace firstlook::sim::ur {

ToolPath ToolPath::line(const Pose& from, const Pose& to) { return {from, to}; }

std::optional<ToolPath> ToolPath::arc(const Pose& from, const Eigen::Vector3d& via, const Pose& to, ArcTurn turn) {
  constexpr double kFlat = 1e-6;  // of the squared size: three points on a line
  const Eigen::Vector3d a = via - from.translation(), b = to.translation() - from.translation();
  const Eigen::Vector3d normal = a.cross(b);
  const double doubled_area_2 = normal.squaredNorm();
  if (!(doubled_area_2 > kFlat * kFlat * std::pow(std::max(a.squaredNorm(), b.squaredNorm()), 2))) return std::nullopt;
  // Circumcentre of the triangle, from its first corner.
  const Eigen::Vector3d to_center =
      (a.squaredNorm() * b.cross(normal) + b.squaredNorm() * normal.cross(a)) / (2 * doubled_area_2);
  ToolPath path(from, to);
  path.circle_ = Circle{.center = from.translation() + to_center, .axis = normal.normalized()};
  // About `axis` the second point comes before the third.
  const Eigen::Vector3d first = -to_center, last = to.translation() - path.circle_->center;
  const double angle_rad = std::atan2(first.cross(last).dot(path.circle_->axis), first.dot(last));
  path.circle_->angle_rad = angle_rad > 0 ? angle_rad : angle_rad + 2 * std::numbers::pi;
  path.turns_with_circle_ = turn == ArcTurn::kWithTheCircle;
  return path;
}

double ToolPath::way() const {
  if (circle_) {
    const double radius_m = (from_.translation() - circle_->center).norm();
    if (turns_with_circle_) return radius_m * circle_->angle_rad;
    return std::max(radius_m * circle_->angle_rad,
                    rotation_vector_of(from_.linear().transpose() * to_.linear()).norm());
  }
  const double way_m = (to_.translation() - from_.translation()).norm();
  return std::max(way_m, rotation_vector_of(from_.linear().transpose() * to_.linear()).norm());
}

Pose ToolPath::at(double share) const {
  Pose at = Pose::Identity();
  const Eigen::Quaterniond first(from_.linear()), last(to_.linear());
  at.linear() = first.slerp(share, last).toRotationMatrix();
  if (!circle_) {
    at.translation() = from_.translation() + share * (to_.translation() - from_.translation());
    return at;
  }
  const Eigen::AngleAxisd turn(share * circle_->angle_rad, circle_->axis);
  at.translation() = circle_->center + turn * (from_.translation() - circle_->center);
  if (turns_with_circle_) at.linear() = turn.toRotationMatrix() * from_.linear();
  return at;
}

}  // namespace firstlook::sim::ur
