#include "algorithms/motion/guardian.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

/// Where on the segment the joints are nearest to q, each joint weighted by its lever arm.
double nearest_fraction(const Body& body, const GuardianPath& path, const JointVector& q) {
  const JointVector along = path.to - path.from;
  const JointVector offset = q - path.from;
  double dot = 0;
  double length = 0;
  for (int j = 0; j < q.size(); ++j) {
    double weight = 0;
    for (const LeverArms& levers : body.levers) weight = std::max(weight, levers[static_cast<std::size_t>(j)]);
    dot += weight * weight * along[j] * offset[j];
    length += weight * weight * along[j] * along[j];
  }
  return length > 0 ? std::clamp(dot / length, 0.0, 1.0) : 0;
}

/// No point of the body is displaced farther between the two configurations: what the ends of the axis move, and what
/// the turn moves at the radius (a turn by t displaces by 2 sin(t/2) = |R - R'|_F / sqrt 2 for each metre).
double displacement_m(const ArmModel& arm, const Body& body, const JointVector& a, const JointVector& b) {
  const LinkFrames at_a = forward(arm, a);
  const LinkFrames at_b = forward(arm, b);
  double largest = 0;
  for (const Capsule& c : body.capsules) {
    const Pose& pa = at_a.base_T_link[static_cast<std::size_t>(c.link)];
    const Pose& pb = at_b.base_T_link[static_cast<std::size_t>(c.link)];
    const double turn = (pa.linear() - pb.linear()).norm() / std::numbers::sqrt2;
    const double ends = std::max((pa * c.a - pb * c.a).norm(), (pa * c.b - pb * c.b).norm());
    largest = std::max(largest, ends + turn * c.radius_m);
  }
  return largest;
}

/// Looks at points all over a capsule: its axis (nothing may be within the radius), and its surface.
class CapsuleSampler {
 public:
  using Margins = std::array<double, 2>;  // one for each of two requirements

  CapsuleSampler(const FreeSpace& space, const std::array<Clearance, 2>& needs, const Capsule& placed, double spacing_m)
      : space_(space), needs_(needs), c_(placed), spacing_m_(spacing_m) {
    const Eigen::Vector3d d = c_.b - c_.a;
    length_m_ = d.norm();
    axis_ = length_m_ > 0 ? Eigen::Vector3d(d / length_m_) : Eigen::Vector3d::UnitZ();
    across_ = axis_.unitOrthogonal();
    side_ = axis_.cross(across_);
  }

  Margins margins() {
    const int rings = 1 + static_cast<int>(std::ceil(length_m_ / spacing_m_));
    for (int i = 0; i <= rings; ++i) {
      const Eigen::Vector3d centre = c_.a + (c_.b - c_.a) * (static_cast<double>(i) / rings);
      take(centre, c_.radius_m);
      ring(centre, c_.radius_m);
    }
    const int latitudes = 1 + static_cast<int>(std::ceil(c_.radius_m * std::numbers::pi / 2 / spacing_m_));
    for (int i = 1; i <= latitudes; ++i) {
      const double angle = std::numbers::pi / 2 * i / latitudes;
      const Eigen::Vector3d along = axis_ * (c_.radius_m * std::sin(angle));
      ring(c_.b + along, c_.radius_m * std::cos(angle));
      ring(c_.a - along, c_.radius_m * std::cos(angle));
    }
    return margins_;
  }

 private:
  void take(const Eigen::Vector3d& point, double radius_m) {
    const Margins here = space_.margins_m(point, needs_);
    for (std::size_t i = 0; i < here.size(); ++i) margins_[i] = std::min(margins_[i], here[i] - radius_m);
  }

  void ring(const Eigen::Vector3d& centre, double radius_m) {
    const int points = std::max(1, static_cast<int>(std::ceil(2 * std::numbers::pi * radius_m / spacing_m_)));
    const double c = std::cos(2 * std::numbers::pi / points);
    const double s = std::sin(2 * std::numbers::pi / points);
    double x = radius_m;
    double y = 0;
    for (int i = 0; i < points; ++i) {
      take(centre + across_ * x + side_ * y, 0);
      const double turned = c * x - s * y;
      y = s * x + c * y;
      x = turned;
    }
  }

  const FreeSpace& space_;
  const std::array<Clearance, 2>& needs_;
  const Capsule& c_;
  double spacing_m_;
  double length_m_ = 0;
  Eigen::Vector3d axis_, across_, side_;
  Margins margins_ = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
};

/// What a distance to voxel centres has to be shortened by.
Clearance half_a_voxel(const FreeSpace& space) {
  const DistanceField* field = space.field != nullptr ? space.field : space.revoked;
  return {.voxels_m = field != nullptr ? field->geometry().resolution_m * std::sqrt(3.0) / 2 : 0, .surface_m = 0};
}

}  // namespace

GuardianVerdict check(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                      const JointVector& q_rad, const std::optional<GuardianPath>& path, double deviation_max_m,
                      double spacing_m) {
  ENSURE(4141, spacing_m > 0 && q_rad.size() == arm.joints);
  GuardianVerdict verdict;
  if (path) {
    verdict.path_fraction = nearest_fraction(body, *path, q_rad);
    verdict.deviation_m = displacement_m(arm, body, q_rad, interpolate(path->from, path->to, verdict.path_fraction));
  }
  verdict.margin_m = verdict.distance_m = std::numeric_limits<double>::infinity();
  const std::array<Clearance, 2> needs = {clearance, half_a_voxel(space)};
  const Capsules placed = place(body.capsules, forward(arm, q_rad));
  for (std::size_t i = 0; i < placed.size(); ++i) {
    if (body.exempt[i] != 0) continue;
    const auto [margin, distance] = CapsuleSampler(space, needs, placed[i], spacing_m).margins();
    if (margin < verdict.margin_m) verdict.margin_m = margin, verdict.capsule = static_cast<int>(i);
    verdict.distance_m = std::min(verdict.distance_m, distance);
  }
  if (!(verdict.margin_m >= 0)) {
    verdict.finding = GuardianFinding::kNotFree;
  } else if (!(verdict.deviation_m <= deviation_max_m)) {
    verdict.finding = GuardianFinding::kDeviation;
  }
  return verdict;
}

Clearance guardian_clearance(const Clearance& planned, double stopping_m) {
  return {.voxels_m = planned.voxels_m - stopping_m, .surface_m = planned.surface_m - stopping_m};
}

}  // namespace firstlook
