#include "algorithms/kinematics/self_collision.hpp"

#include <algorithm>
#include <limits>

namespace firstlook {

double segment_distance_m(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                          const Eigen::Vector3d& b1) {
  constexpr double kPoint_m2 = 1e-18;  // shorter than a nanometre: a point
  const Eigen::Vector3d da = a1 - a0;
  const Eigen::Vector3d db = b1 - b0;
  const Eigen::Vector3d r = a0 - b0;
  const double aa = da.squaredNorm();
  const double bb = db.squaredNorm();
  const double br = db.dot(r);
  double s = 0;
  double t = 0;
  if (aa <= kPoint_m2) {
    t = bb <= kPoint_m2 ? 0 : std::clamp(br / bb, 0.0, 1.0);
  } else {
    const double ar = da.dot(r);
    if (bb <= kPoint_m2) {
      s = std::clamp(-ar / aa, 0.0, 1.0);
    } else {
      const double ab = da.dot(db);
      const double det = aa * bb - ab * ab;
      if (det > 1e-12 * aa * bb) s = std::clamp((ab * br - ar * bb) / det, 0.0, 1.0);  // else parallel: any s will do
      t = (ab * s + br) / bb;
      if (t < 0) {
        t = 0;
        s = std::clamp(-ar / aa, 0.0, 1.0);
      } else if (t > 1) {
        t = 1;
        s = std::clamp((ab - ar) / aa, 0.0, 1.0);
      }
    }
  }
  return (r + da * s - db * t).norm();
}

double capsule_distance_m(const Capsule& a, const Capsule& b) {
  return segment_distance_m(a.a, a.b, b.a, b.b) - a.radius_m - b.radius_m;
}

SelfPairs self_pairs_of_arm(const Capsules& arm_body, double clearance_m) {
  SelfPairs pairs;
  for (std::size_t i = 0; i < arm_body.size(); ++i) {
    for (std::size_t j = 0; j < arm_body.size(); ++j) {
      const int near = arm_body[i].link;
      const int far = arm_body[j].link;
      const bool can_meet = far - near >= 3 || (near == 1 && far == 3) || (near == 2 && far == 4);
      if (!can_meet) continue;
      pairs.push_back({.near = static_cast<int>(i),
                       .far = static_cast<int>(j),
                       .axes_apart_m = arm_body[i].radius_m + arm_body[j].radius_m - 2 * kBodyPadding_m + clearance_m});
    }
  }
  return pairs;
}

SelfPairs self_pairs_of_arm(const ArmModel& arm, double clearance_m) {
  if (!arm.own_pairs) return self_pairs_of_arm(arm.body, clearance_m);
  SelfPairs pairs;
  for (const CapsulePair& pair : arm.pairs) {
    const double radii_m = arm.body[pair.near].radius_m + arm.body[pair.far].radius_m - 2 * kBodyPadding_m;
    pairs.push_back({.near = pair.near, .far = pair.far, .axes_apart_m = radii_m + clearance_m});
  }
  return pairs;
}

double self_margin_m(const Capsules& placed, const SelfPairs& pairs) {
  double margin = std::numeric_limits<double>::infinity();
  for (const SelfPair& pair : pairs) {
    const Capsule& a = placed[static_cast<std::size_t>(pair.near)];
    const Capsule& b = placed[static_cast<std::size_t>(pair.far)];
    margin = std::min(margin, segment_distance_m(a.a, a.b, b.a, b.b) - pair.axes_apart_m);
  }
  return margin;
}

}  // namespace firstlook
