#include "algorithms/motion/body.hpp"

#include <algorithm>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr int kEnvelopeLinksApart =
    4;  // an envelope of 0.2 m at the flange always holds the wrist and the forearm's end
constexpr int kCameraLinksApart = 2;

/// Distance from axis 1 and heights of a capsule of link 0 or 1; the same for every angle of joint 1.
struct Ring {
  double radius_m = 0;
  double low_m = 0;
  double high_m = 0;
};

Ring ring_of(const ArmModel& arm, const Capsule& capsule) {
  const LinkFrames frames = forward(arm, JointVector::zero(arm.joints));
  const Pose& base_T_link = frames.base_T_link[static_cast<std::size_t>(capsule.link)];
  const Eigen::Vector3d a = base_T_link * capsule.a;
  const Eigen::Vector3d b = base_T_link * capsule.b;
  return {.radius_m = std::max(a.head<2>().norm(), b.head<2>().norm()) + capsule.radius_m,
          .low_m = std::min(a.z(), b.z()) - capsule.radius_m,
          .high_m = std::max(a.z(), b.z()) + capsule.radius_m};
}

void widen(BaseAllowance& allowance, const Ring& ring) {
  allowance.radius_m = std::max(allowance.radius_m, ring.radius_m);
  allowance.z_low_m = std::min(allowance.z_low_m, ring.low_m);
  allowance.z_high_m = std::max(allowance.z_high_m, ring.high_m);
}

/// Appends a capsule with what is derived from it, but no self pairs.
void append(Body& body, const ArmModel& arm, const Capsule& capsule) {
  bool exempt = false;
  if (capsule.link <= 1) {
    const Ring ring = ring_of(arm, capsule);
    exempt = ring.radius_m <= body.allowance.radius_m && ring.low_m >= body.allowance.z_low_m &&
             ring.high_m <= body.allowance.z_high_m;
  }
  body.capsules.push_back(capsule);
  body.levers.push_back(lever_arms(arm, capsule));
  body.exempt.push_back(exempt ? 1 : 0);
}

}  // namespace

BaseAllowance base_allowance(const ArmModel& arm) {
  BaseAllowance allowance;
  for (const Capsule& capsule : arm.body) {
    if (capsule.link > 1) continue;
    widen(allowance, ring_of(arm, capsule));
  }
  return allowance;
}

Body bare_body(const ArmModel& arm) {
  Body body;
  body.allowance = base_allowance(arm);
  for (const Capsule& capsule : arm.body) append(body, arm, capsule);
  body.self_pairs = self_pairs_of_arm(arm, kSelfClearance_m);
  return body;
}

void attach(Body& body, const ArmModel& arm, const Capsule& capsule, int links_apart, double slack_m) {
  ENSURE(4101, capsule.link >= 0 && capsule.link <= arm.joints && capsule.radius_m >= slack_m);
  const auto index = static_cast<int>(body.capsules.size());
  append(body, arm, capsule);
  for (std::size_t i = 0; i < arm.body.size(); ++i) {
    if (capsule.link - arm.body[i].link < links_apart) continue;
    const double radii = arm.body[i].radius_m - kBodyPadding_m + capsule.radius_m - slack_m;
    body.self_pairs.push_back({.near = static_cast<int>(i), .far = index, .axes_apart_m = radii + kSelfClearance_m});
  }
}

void add_envelope(Body& body, const ArmModel& arm, double radius_m, int link) {
  attach(body, arm, {.radius_m = radius_m, .link = link}, kEnvelopeLinksApart);
}

Body body_with_envelope(const ArmModel& arm, double radius_m, int link) {
  Body body = bare_body(arm);
  add_envelope(body, arm, radius_m, link < 0 ? arm.joints : link);
  return body;
}

Body body_with_envelopes(const ArmModel& arm, double radius_m) {
  Body body = bare_body(arm);
  widen(body.allowance, ring_of(arm, {.radius_m = radius_m, .link = 1}));
  for (int link = 1; link <= arm.joints; ++link) add_envelope(body, arm, radius_m, link);
  return body;
}

Body body_with_camera(const ArmModel& arm, const Transform<Flange, Camera>& flange_T_camera, const CameraBody& camera) {
  Body body = bare_body(arm);
  const Eigen::Vector3d centre = flange_T_camera.translation();
  const Eigen::Vector3d along = flange_T_camera.rotation().col(0) * camera.half_length_m;
  const double cable = camera.cable_allowance_m;
  attach(body, arm, {centre - along, centre + along, camera.radius_m + cable, arm.joints}, kCameraLinksApart, cable);
  attach(body, arm, {Eigen::Vector3d::Zero(), centre, camera.bracket_radius_m + cable, arm.joints}, kCameraLinksApart,
         cable);
  return body;
}

}  // namespace firstlook
