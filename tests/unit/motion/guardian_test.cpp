#include "algorithms/motion/guardian.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "algorithms/kinematics/speed.hpp"
#include "algorithms/motion/certificate.hpp"
#include "algorithms/motion/clearance.hpp"
#include "random_cell.hpp"

using namespace firstlook;
using namespace firstlook::test;

namespace {

const ArmModel kArm = *find_arm_model("ur5");

/// Every point that the guardian may look at, and how far off the axis it is.
template <typename Visit>
void for_each_point(const Capsule& c, double spacing_m, Visit visit) {
  const double length_m = (c.b - c.a).norm();
  const Eigen::Vector3d axis = length_m > 0 ? Eigen::Vector3d((c.b - c.a) / length_m) : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d across = axis.unitOrthogonal(), side = axis.cross(across);
  const auto ring = [&](const Eigen::Vector3d& centre, double radius_m) {
    const int points = std::max(1, static_cast<int>(std::ceil(2 * std::numbers::pi * radius_m / spacing_m)));
    for (int i = 0; i < points; ++i) {
      const double angle = 2 * std::numbers::pi * i / points;
      visit(Eigen::Vector3d(centre + radius_m * (std::cos(angle) * across + std::sin(angle) * side)), c.radius_m);
    }
  };
  const int rings = 1 + static_cast<int>(std::ceil(length_m / spacing_m));
  for (int i = 0; i <= rings; ++i) {
    const Eigen::Vector3d centre = c.a + (c.b - c.a) * (static_cast<double>(i) / rings);
    visit(centre, 0.0);
    ring(centre, c.radius_m);
  }
  const int latitudes = 1 + static_cast<int>(std::ceil(c.radius_m * std::numbers::pi / 2 / spacing_m));
  for (int i = 1; i <= latitudes; ++i) {
    const double angle = std::numbers::pi / 2 * i / latitudes;
    ring(c.b + c.radius_m * std::sin(angle) * axis, c.radius_m * std::cos(angle));
    ring(c.a - c.radius_m * std::sin(angle) * axis, c.radius_m * std::cos(angle));
  }
}

}  // namespace

TEST_CASE("on the path at any time the deviation is zero, off it the displacement is measured in metres") {
  const Body body = bare_body(kArm);
  const FreeSpace space;
  const JointVector from = default_start(kArm);
  JointVector to = from;
  to[0] += 1.2;
  to[3] += 0.3;
  const GuardianPath path{from, to};
  for (const double t : {0.0, 0.3, 0.9, 1.0}) {
    const GuardianVerdict verdict = check(kArm, body, space, {}, interpolate(from, to, t), path);
    CHECK(verdict.fine());
    CHECK(verdict.deviation_m < 1e-12);
    CHECK(verdict.path_fraction == Approx(t));
  }
  JointVector off = interpolate(from, to, 0.5);
  off[1] += 0.03;
  const GuardianVerdict verdict = check(kArm, body, space, {}, off, path);
  CHECK(verdict.finding == GuardianFinding::kDeviation);
  CHECK(verdict.deviation_m > 0.01);
  CHECK(verdict.deviation_m < 0.03);
  CHECK(check(kArm, body, space, {}, off, path, 0.05).fine());
  CHECK(check(kArm, body, space, {}, off, std::nullopt).fine());
}

TEST_CASE("deviation is at least what any sampled body point is displaced by") {
  const Body body = body_with_envelope(kArm);
  const FreeSpace space;
  Random random(1);
  for (int i = 0; i < 300; ++i) {
    const JointVector from = random_joints(random, 2);
    const JointVector to = from + random_joints(random, 0.5);
    const JointVector q = interpolate(from, to, random.uniform()) + random_joints(random, 0.02);
    const GuardianVerdict verdict = check(kArm, body, space, {}, q, GuardianPath{from, to}, 0.01, 0.1);
    const LinkFrames here = forward(kArm, q);
    const LinkFrames there = forward(kArm, interpolate(from, to, verdict.path_fraction));
    for (const Capsule& c : body.capsules) {
      const auto link = static_cast<std::size_t>(c.link);
      const Eigen::Vector3d p = c.a + c.radius_m * random.direction();
      REQUIRE((here.base_T_link[link] * p - there.base_T_link[link] * p).norm() <= verdict.deviation_m + 1e-12);
    }
  }
}

TEST_CASE("a small thing deep inside a large capsule is seen") {
  const Body body = body_with_envelope(kArm);
  FreeSpace space;
  const JointVector q = default_start(kArm);
  const Eigen::Vector3d hand = forward(kArm, q).flange().translation();
  REQUIRE(check(kArm, body, space, {}, q, std::nullopt).fine());
  space.keep_out_boxes.push_back({hand - Eigen::Vector3d::Constant(0.002), hand + Eigen::Vector3d::Constant(0.002)});
  const GuardianVerdict verdict = check(kArm, body, space, {}, q, std::nullopt);
  CHECK(verdict.finding == GuardianFinding::kNotFree);
  CHECK(verdict.margin_m < -0.15);
  CHECK(verdict.capsule >= 0);
}

TEST_CASE("points that are left out would not have been nearer") {
  constexpr double kSpacing_m = 0.025;
  const Body body = body_with_envelope(kArm);
  const Clearance need{.voxels_m = 0.09, .surface_m = 0.02};
  Random random(6);
  int on_the_surface = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    RandomCell cell(seed, 8);
    const RandomCell left = take_from_zone(cell, seed, 25);
    FreeSpace space;
    space.field = &cell.field;
    space.zone_intact = seed % 2 == 0;
    if (space.zone_intact) space.revoked = &left.field;
    for (int i = 0; i < 250; ++i) {
      const JointVector q = random_joints(random, 3.1);
      const Capsules placed = place(body.capsules, forward(kArm, q));
      double on_axes_m = 1, everywhere_m = 1;
      for (std::size_t k = 0; k < placed.size(); ++k) {
        if (body.exempt[k] != 0) continue;
        for_each_point(placed[k], kSpacing_m, [&](const Eigen::Vector3d& point, double off_axis_m) {
          const double margin_m = space.margin_m(point, need) - (placed[k].radius_m - off_axis_m);
          if (off_axis_m == 0) on_axes_m = std::min(on_axes_m, margin_m);
          everywhere_m = std::min(everywhere_m, margin_m);
        });
      }
      REQUIRE(check(kArm, body, space, need, q, std::nullopt, 0.01, kSpacing_m).margin_m ==
              Approx(everywhere_m).margin(1e-9));
      on_the_surface += everywhere_m < on_axes_m - 1e-6 ? 1 : 0;
    }
  }
  CHECK(on_the_surface > 30);  // where the field's bound sags: the axis alone does not tell
}

TEST_CASE("the distance to what is not free does not depend on what is required, and half a voxel is taken off") {
  const Body body = bare_body(kArm);
  const Clearance strict{.voxels_m = 0.09, .surface_m = 0.02}, none;
  Random random(3);
  const RandomCell cell(4, 8);
  FreeSpace mapped;
  mapped.field = &cell.field;
  mapped.zone_intact = false;
  const double half_diagonal_m = cell.field.geometry().resolution_m * std::sqrt(3.0) / 2;
  FreeSpace zone_only;
  zone_only.zone = {0.5, 1.15, 0.0};
  for (int i = 0; i < 100; ++i) {
    const JointVector q = random_joints(random, 3.1);
    const GuardianVerdict asked = check(kArm, body, mapped, strict, q, std::nullopt);
    const GuardianVerdict unasked = check(kArm, body, mapped, none, q, std::nullopt);
    CHECK(asked.distance_m == Approx(unasked.distance_m));
    CHECK(asked.distance_m == Approx(unasked.margin_m - half_diagonal_m));
    CHECK(asked.margin_m == Approx(unasked.margin_m - strict.voxels_m));
  }
  const GuardianVerdict in_zone = check(kArm, body, zone_only, strict, default_start(kArm), std::nullopt);
  REQUIRE(in_zone.distance_m > 0);
  CHECK(in_zone.margin_m == Approx(in_zone.distance_m - strict.surface_m));  // a surface is where it is
}

TEST_CASE("the guardian agrees with certified paths and sees bodies that leave free space") {
  const Body body = bare_body(kArm);
  const ClearanceTerms terms = required_clearance({});
  const Clearance planned = terms.clearance();
  const Clearance watched = guardian_clearance(planned, terms.stopping_m);
  CHECK(watched.voxels_m == Approx(planned.voxels_m - terms.stopping_m));
  CHECK(watched.surface_m == Approx(planned.surface_m - terms.stopping_m));
  Random random(2);
  int certified = 0;
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const RandomCell cell(seed, 8);
    FreeSpace space;
    space.field = &cell.field;
    for (int i = 0; i < 600; ++i) {
      const JointVector from = random_joints(random, 3.1);
      JointVector to = from + random_joints(random, 0.5);
      to[2] = std::clamp(to[2], -3.1, 3.1);
      if (certify(kArm, body, space, planned, from, to).certified()) {
        ++certified;
        for (int k = 0; k <= 10; ++k) {
          const GuardianVerdict verdict =
              check(kArm, body, space, watched, interpolate(from, to, k / 10.0), GuardianPath{from, to});
          REQUIRE(verdict.fine());  // no false alarm on a certified path
        }
      }
      // Whatever brute force finds in collision (axis inside the requirement) the guardian must not call fine. Self
      // collision is the planner's matter.
      Body alone = body;
      alone.self_pairs.clear();
      if (i % 10 == 0 && sampled_margin_m(kArm, alone, cell, space, watched, from, 0.01) < -0.005) {
        ++alarms;
        REQUIRE(check(kArm, body, space, watched, from, std::nullopt).finding == GuardianFinding::kNotFree);
      }
    }
  }
  CHECK(certified > 50);
  CHECK(alarms > 50);
}
