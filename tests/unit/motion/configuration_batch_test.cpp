#include "algorithms/motion/configuration_batch.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "algorithms/kinematics/other_arms.hpp"
#include "platform/core/processor.hpp"
#include "random_cell.hpp"

using namespace firstlook;
using namespace firstlook::test;

namespace {

constexpr Clearance kNeed{.voxels_m = 0.06, .surface_m = 0.015};

std::vector<JointVector> draw(const ArmModel& arm, Random& random, int count) {
  std::vector<JointVector> drawn;
  for (int i = 0; i < count; ++i) {
    JointVector q = JointVector::zero(arm.joints);
    for (int j = 0; j < arm.joints; ++j) {
      const auto k = static_cast<std::size_t>(j);
      q[j] = random.uniform(arm.lower_rad[k], arm.upper_rad[k]);
    }
    drawn.push_back(q);
  }
  return drawn;
}

std::vector<std::uint8_t> ask(const ArmModel& arm, const Body& body, const FreeSpace& space,
                              const std::vector<JointVector>& q_rad, double margin_m) {
  std::vector<std::uint8_t> free(q_rad.size(), 7);
  configurations_are_free(arm, body, space, kNeed, q_rad, margin_m, free);
  return free;
}

/// Every kind of space that a job meets: before the map, beside it, after hits have taken from the zone.
std::vector<FreeSpace> spaces_of(const RandomCell& cell, const RandomCell& zone_left) {
  FreeSpace mapped, blind, fenced, revoked;
  mapped.field = fenced.field = revoked.field = &cell.field;
  mapped.zone_intact = false;
  fenced.keep_out_boxes.push_back({{0.3, -0.2, 0.1}, {0.5, 0.3, 0.4}});
  fenced.keep_out_planes.push_back({Eigen::Vector3d(-1, 0.2, 0).normalized(), -0.6});
  revoked.revoked = &zone_left.field;
  FreeSpace nothing = blind;
  nothing.zone_intact = false;
  return {mapped, blind, fenced, revoked, nothing};
}

}  // namespace

TEST_CASE("many configurations at once are as free as each alone, with AVX2 and without") {
  for (const char* name : {"ur5", "ur10e", "two_joint", "pr2_like"}) {
    const ArmModel arm = *find_arm_model(name);
    Pose mount = Pose::Identity();
    mount.translation() = Eigen::Vector3d(0, -0.07, 0.05);
    const Body bodies[] = {bare_body(arm), body_with_envelope(arm),
                           body_with_camera(arm, Transform<Flange, Camera>(mount))};
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      const RandomCell cell(seed, 12), zone_left(seed + 100, 25);
      Random random(seed, 5);
      for (const FreeSpace& space : spaces_of(cell, zone_left)) {
        for (const Body& body : bodies) {
          for (const double margin_m : {kMarginMin_m, 0.015, -0.03}) {
            const std::vector<JointVector> drawn = draw(arm, random, 61);  // not a whole number of eights
            const std::vector<std::uint8_t> free = ask(arm, body, space, drawn, margin_m);
            for (std::size_t i = 0; i < drawn.size(); ++i) {
              REQUIRE(free[i] == (configuration_is_free(arm, body, space, kNeed, drawn[i], margin_m) ? 1 : 0));
            }
            const PortableOnly portable;
            REQUIRE(ask(arm, body, space, drawn, margin_m) == free);
          }
        }
      }
    }
  }
}

TEST_CASE("configurations at the edge of what is free are decided as each alone") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  const RandomCell cell(3, 15);
  FreeSpace space;
  space.field = &cell.field;
  Random random(1, 6);
  int edges = 0;
  for (const JointVector& q : draw(arm, random, 4000)) {
    const double margin_m = configuration_margin(arm, body, space, kNeed, q);
    if (margin_m < -0.05 || margin_m > 0.3) continue;
    for (const double off_m : {-1e-3, -1e-5, -1e-9, 1e-9, 1e-5, 1e-3}) {
      const double asked_m = margin_m + off_m;
      ++edges;
      REQUIRE((ask(arm, body, space, {q}, asked_m)[0] != 0) ==
              configuration_is_free(arm, body, space, kNeed, q, asked_m));
    }
  }
  CHECK(edges > 1000);
}

TEST_CASE("joints that have turned many times are decided as each alone") {
  ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  for (std::size_t j = 0; j < 6; ++j) {
    if (j != 2) arm.lower_rad[j] = -1e6, arm.upper_rad[j] = 1e6;
  }
  const RandomCell cell(2, 12);
  FreeSpace space;
  space.field = &cell.field;
  Random random(4, 5);
  for (const double turns : {4.0, 100.0, 1e5}) {
    std::vector<JointVector> drawn;
    for (int i = 0; i < 400; ++i) {
      JointVector q = JointVector::zero(6);
      for (int j = 0; j < 6; ++j) q[j] = random.uniform(-3, 3) + (j != 2 ? 6.283185307179586 * std::round(turns) : 0);
      drawn.push_back(q);
    }
    const std::vector<std::uint8_t> free = ask(arm, body, space, drawn, 0.005);
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      REQUIRE((free[i] != 0) == configuration_is_free(arm, body, space, kNeed, drawn[i], 0.005));
    }
  }
}

TEST_CASE("what is no configuration is not free") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  JointVector beyond = default_start(arm), no_number = beyond, huge = beyond;
  beyond[2] = arm.upper_rad[2] + 0.1;
  no_number[3] = std::numeric_limits<double>::quiet_NaN();
  huge[0] = 1e300;
  const RandomCell cell(1, 0);
  FreeSpace space;
  space.field = &cell.field;
  const auto free = ask(arm, body, space, {default_start(arm), beyond, no_number, huge, JointVector::zero(5)}, 0);
  CHECK(free == std::vector<std::uint8_t>{1, 0, 0, 0, 0});
}
