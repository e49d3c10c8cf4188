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

/// How far the field's bound at a point can lie below the distance d to the nearest voxel there. The centres c around a
/// point p have d(c) >= d - |c - p|, so the square of the bound is at least d² - 2 d sum w |c - p|, and that sum is at
/// most half a voxel's diagonal.
double field_sag_m(const FreeSpace& space) {
  constexpr double kRounding_m = 1e-5;
  double sag_m = 0;
  for (const DistanceField* field : {space.field, space.revoked}) {
    if (field != nullptr) sag_m = std::max(sag_m, field->geometry().resolution_m * std::sqrt(3.0) + kRounding_m);
  }
  return sag_m;
}

/// Looks at points all over a capsule: its axis (nothing may be within the radius), and its surface.
class CapsuleSampler {
 public:
  using Margins = std::array<double, 2>;  // one for each of two requirements
  static constexpr Margins kFar = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};

  CapsuleSampler(const FreeSpace& space, const std::array<Clearance, 2>& needs, const Capsule& placed, double spacing_m)
      : space_(space), needs_(needs), c_(placed), spacing_m_(spacing_m) {
    const Eigen::Vector3d d = c_.b - c_.a;
    const double length_m = d.norm();
    axis_ = length_m > 0 ? Eigen::Vector3d(d / length_m) : Eigen::Vector3d::UnitZ();
    across_ = axis_.unitOrthogonal();
    side_ = axis_.cross(across_);
    rings_ = 1 + static_cast<int>(std::ceil(length_m / spacing_m_));
  }

  [[nodiscard]] Margins axis_margins() const {
    Margins least = kFar;
    for (int i = 0; i <= rings_; ++i) take(centre(i), c_.radius_m, least);
    return least;
  }

  /// Lowers `least` to what the surface says. Where the axis has so much room that no point around it can, none is
  /// looked at: a margin falls by the radius from the axis to the surface, and by what the field's bound can be low.
  void lower_to_surface(Margins& least) const {
    for (int i = 0; i <= rings_; ++i) {
      if (!can_lower(centre(i), least)) continue;
      ring(centre(i), c_.radius_m, least);
      if (i == 0) cap(c_.a, -axis_, least);
      if (i == rings_) cap(c_.b, axis_, least);
    }
  }

 private:
  [[nodiscard]] Eigen::Vector3d centre(int ring) const {
    return c_.a + (c_.b - c_.a) * (static_cast<double>(ring) / rings_);
  }

  void take(const Eigen::Vector3d& point, double radius_m, Margins& least) const {
    const Margins here = space_.margins_m(point, needs_);
    for (std::size_t i = 0; i < here.size(); ++i) least[i] = std::min(least[i], here[i] - radius_m);
  }

  [[nodiscard]] bool can_lower(const Eigen::Vector3d& centre, const Margins& least) const {
    Margins here = kFar;
    take(centre, c_.radius_m + field_sag_m(space_), here);
    return here[0] <= least[0] || here[1] <= least[1];
  }

  void cap(const Eigen::Vector3d& centre, const Eigen::Vector3d& outwards, Margins& least) const {
    const int latitudes = 1 + static_cast<int>(std::ceil(c_.radius_m * std::numbers::pi / 2 / spacing_m_));
    for (int i = 1; i <= latitudes; ++i) {
      const double angle = std::numbers::pi / 2 * i / latitudes;
      ring(centre + outwards * (c_.radius_m * std::sin(angle)), c_.radius_m * std::cos(angle), least);
    }
  }

  void ring(const Eigen::Vector3d& centre, double radius_m, Margins& least) const {
    const int points = std::max(1, static_cast<int>(std::ceil(2 * std::numbers::pi * radius_m / spacing_m_)));
    const double c = std::cos(2 * std::numbers::pi / points);
    const double s = std::sin(2 * std::numbers::pi / points);
    double x = radius_m;
    double y = 0;
    for (int i = 0; i < points; ++i) {
      take(centre + across_ * x + side_ * y, 0, least);
      const double turned = c * x - s * y;
      y = s * x + c * y;
      x = turned;
    }
  }

  const FreeSpace& space_;
  const std::array<Clearance, 2>& needs_;
  const Capsule& c_;
  double spacing_m_;
  int rings_ = 1;
  Eigen::Vector3d axis_, across_, side_;
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
  const std::array<Clearance, 2> needs = {clearance, half_a_voxel(space)};
  const Capsules placed = place(body.capsules, forward(arm, q_rad));
  CapsuleSampler::Margins least = CapsuleSampler::kFar;
  const auto look = [&](auto&& at_capsule) {
    for (std::size_t i = 0; i < placed.size(); ++i) {
      if (body.exempt[i] != 0) continue;
      const double before = least[0];
      at_capsule(CapsuleSampler(space, needs, placed[i], spacing_m));
      if (least[0] < before) verdict.capsule = static_cast<int>(i);
    }
  };
  look([&](const CapsuleSampler& capsule) {
    const CapsuleSampler::Margins axis = capsule.axis_margins();
    for (std::size_t i = 0; i < axis.size(); ++i) least[i] = std::min(least[i], axis[i]);
  });
  look([&](const CapsuleSampler& capsule) { capsule.lower_to_surface(least); });
  verdict.margin_m = least[0];
  verdict.distance_m = least[1];
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
