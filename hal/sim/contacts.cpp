#include "hal/sim/contacts.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/kinematics/self_collision.hpp"
#include "hal/sim/ray_geometry.hpp"

namespace firstlook::sim {
namespace {

constexpr double kHousingHalfLength_m = 0.14;
constexpr double kHousingRadius_m = 0.035;
constexpr double kStandsStill_m = 1e-5;  // less than encoder noise moves the flange

/// The largest way of any body point between two placements: that of an end of an axis.
double largest_way_m(const Capsules& from, const Capsules& to) {
  double way_m = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    way_m = std::max({way_m, (to[i].a - from[i].a).norm(), (to[i].b - from[i].b).norm()});
  }
  return way_m;
}

Capsules base_links_of(const Capsules& body) {
  Capsules links;
  for (const Capsule& capsule : body) {
    if (capsule.link <= 1) links.push_back(capsule);
  }
  return links;
}

}  // namespace

Capsule true_housing(int link, const Pose& link_T_camera) {
  const double half_axis_m = kHousingHalfLength_m - kHousingRadius_m;
  return {link_T_camera * Eigen::Vector3d(-half_axis_m, 0, 0), link_T_camera * Eigen::Vector3d(half_axis_m, 0, 0),
          kHousingRadius_m, link};
}

Capsules true_capsules(const ArmModel& arm, int link, const Pose& link_T_camera) {
  Capsules capsules = true_body(arm);
  if (link > 0) capsules.push_back(true_housing(link, link_T_camera));
  return capsules;
}

ContactMonitor::ContactMonitor(const ArmModel& arm, const Capsules& body, const BaseAllowance& allowance,
                               const SafeZone& zone, const TrueWorld& world)
    : arm_(arm),
      body_(body),
      base_links_(base_links_of(arm.body)),
      allowance_(allowance),
      zone_(zone),
      world_(&world) {}

void ContactMonitor::set_world(const TrueWorld& world) { world_ = &world; }

void ContactMonitor::watch(const KnownFreeView* view) {
  view_ = view;
  overlapped_.assign(view != nullptr ? view->geometry().count() : 0, 0);
  check_number_ = 1;
  outside_ = false;
  last_.clear();
}

bool ContactMonitor::body_moved(Instant, const JointVector& from_rad, const JointVector& to_rad) {
  const Capsules to = place(body_, forward(arm_, to_rad));
  if (!last_.empty() && largest_way_m(last_, to) < kStandsStill_m) return in_contact_;
  const double way_m = largest_way_m(place(body_, forward(arm_, from_rad)), to);
  const int steps = std::max(1, static_cast<int>(std::ceil(way_m / kBodyStep_m)));
  for (int i = 1; i < steps; ++i) {
    const double t = static_cast<double>(i) / steps;
    check(interpolate(from_rad, to_rad, t));
  }
  check(to_rad);
  last_ = to;
  return in_contact_;
}

void ContactMonitor::body_led() {
  last_.clear();
  in_contact_ = outside_ = false;
  check_number_ += 2;  // what the body overlapped is not what it overlaps
}

void ContactMonitor::check(const JointVector& q_rad) {
  ++checks_;
  const LinkFrames frames = forward(arm_, q_rad);
  const Capsules placed = place(body_, frames);
  allowed_.clear();
  for (const Capsule& link : place(base_links_, frames)) {
    if (exempt(link)) allowed_.push_back(link);
  }
  check_contact(placed);
  view_ != nullptr ? check_voxels(placed) : check_zone(placed);
}

bool ContactMonitor::exempt(const Capsule& placed) const {
  if (placed.link > 1) return false;
  const auto within = [&](const Eigen::Vector3d& p) {
    return std::hypot(p.x(), p.y()) + placed.radius_m <= allowance_.radius_m &&
           p.z() - placed.radius_m >= allowance_.z_low_m && p.z() + placed.radius_m <= allowance_.z_high_m;
  };
  return within(placed.a) && within(placed.b);
}

void ContactMonitor::check_contact(const Capsules& placed) {
  const bool touching =
      std::ranges::any_of(placed, [&](const Capsule& capsule) { return !exempt(capsule) && world_->touches(capsule); });
  if (touching && !in_contact_) ++contacts_;
  in_contact_ = touching;
}

void ContactMonitor::check_zone(const Capsules& placed) {
  const bool outside = std::ranges::any_of(placed, [&](const Capsule& capsule) {
    const double inside_m = std::min(zone_.depth_m(capsule.a), zone_.depth_m(capsule.b));
    return !exempt(capsule) && inside_m < capsule.radius_m - kOverlapTolerance_m;
  });
  if (outside && !outside_) ++unknown_entries_;
  outside_ = outside;
}

void ContactMonitor::check_voxels(const Capsules& placed) {
  ++check_number_;
  bool outside_grid = false;
  for (const Capsule& capsule : placed) {
    if (exempt(capsule)) continue;
    walk_capsule(view_->geometry(), capsule, kOverlapTolerance_m,
                 [&](const Eigen::Vector3i& voxel) { occupy(capsule, voxel, outside_grid); });
  }
  if (outside_grid && !outside_) ++unknown_entries_;  // outside the grid nothing is known
  outside_ = outside_grid;
}

/// Whether the part of the capsule that is nearest to the voxel lies inside the safe zone, or inside a link that the
/// base allowance excuses: the upper arm begins inside the housing of joint 2, and adds nothing there.
ContactMonitor::Excuse ContactMonitor::excuse(const Capsule& placed, const Eigen::Vector3i& voxel) const {
  const Eigen::Vector3d axis = placed.b - placed.a;
  const Eigen::Vector3d to_voxel = view_->geometry().center_m(voxel) - placed.a;
  const double length2 = axis.squaredNorm();
  const double t = length2 > 0 ? std::clamp(axis.dot(to_voxel) / length2, 0.0, 1.0) : 0.0;
  const Eigen::Vector3d nearest = placed.a + t * axis;
  const auto holds_part = [&](const Capsule& allowed) {
    return segment_distance_m(nearest, nearest, allowed.a, allowed.b) + placed.radius_m <=
           allowed.radius_m + kOverlapTolerance_m;
  };
  return {.in_zone = zone_.depth_m(nearest) >= placed.radius_m - kOverlapTolerance_m,
          .in_allowed_link = std::ranges::any_of(allowed_, holds_part)};
}

void ContactMonitor::occupy(const Capsule& placed, const Eigen::Vector3i& voxel, bool& outside_grid) {
  if (!view_->geometry().contains(voxel)) {
    outside_grid = true;
    return;
  }
  const std::size_t index = view_->geometry().index(voxel);
  std::uint32_t& last = overlapped_[index];
  if (last == check_number_) return;  // by another capsule
  const bool entered = last + 1 != check_number_;
  const bool known = !entered || view_->free_for_motion(index);
  // Excused for the part that overlaps it now; asked again for every other capsule and at every check.
  if (!known) {
    const Excuse here = excuse(placed, voxel);
    if (here.in_allowed_link || (here.in_zone && !view_->zone_revoked(index))) return;
  }
  last = check_number_;
  if (!known) ++unknown_entries_;
}

}  // namespace firstlook::sim
