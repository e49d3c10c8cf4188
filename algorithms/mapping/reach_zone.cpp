#include "algorithms/mapping/reach_zone.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

/// Axis 1 is z of the base.
Eigen::Vector3d shoulder_m(const ArmModel& arm) { return arm.base_T_first * Eigen::Vector3d(0, 0, arm.dh[0].d_m); }

}  // namespace

double reach_m(const ArmModel& arm, const Capsules& body) {
  // From the shoulder to the origin of each link's frame; link 1 turns about the shoulder's axis at distance a.
  std::array<double, kJointsMax + 1> chain_m{};
  chain_m[1] = std::abs(arm.dh[0].a_m);
  for (int i = 2; i <= arm.joints; ++i) {
    const DhRow& row = arm.dh[static_cast<std::size_t>(i - 1)];
    chain_m[static_cast<std::size_t>(i)] = chain_m[static_cast<std::size_t>(i - 1)] + std::hypot(row.a_m, row.d_m);
  }
  double reach = chain_m[static_cast<std::size_t>(arm.joints)];
  for (const Capsule& capsule : body) {
    if (capsule.link == 0) continue;
    ENSURE(3071, capsule.link > 0 && capsule.link <= arm.joints);
    const double farthest_m = std::max(capsule.a.norm(), capsule.b.norm()) + capsule.radius_m;
    reach = std::max(reach, chain_m[static_cast<std::size_t>(capsule.link)] + farthest_m);
  }
  return reach;
}

std::size_t mark_reach_zone(const GridGeometry& geometry, const ArmModel& arm, const Capsules& body, double margin_m,
                            double floor_m, std::span<std::uint8_t> zone) {
  ENSURE(3072, zone.size() == geometry.count());
  const double radius_m = reach_m(arm, body) + margin_m;
  const Eigen::Vector3d center_m = shoulder_m(arm);
  std::size_t marked = 0;
  for (std::size_t i = 0; i < zone.size(); ++i) {
    const Eigen::Vector3d voxel_m = geometry.center_m(geometry.voxel_at(i));
    const bool inside = voxel_m.z() > floor_m && (voxel_m - center_m).squaredNorm() <= radius_m * radius_m;
    zone[i] = inside ? 1 : 0;
    marked += inside;
  }
  return marked;
}

}  // namespace firstlook
