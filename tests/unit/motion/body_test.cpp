#include "algorithms/motion/body.hpp"

#include <catch2/catch.hpp>

#include "random_cell.hpp"

using namespace firstlook;
using namespace firstlook::test;

TEST_CASE("links 0 and 1 stay inside the base allowance whatever the joints are") {
  Random random(1);
  for (const std::string_view name : {"ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e"}) {
    const ArmModel arm = *find_arm_model(name);
    const Body body = bare_body(arm);
    CHECK(body.allowance.radius_m >= 0.30);
    for (int i = 0; i < 300; ++i) {
      const Capsules placed = place(body.capsules, forward(arm, random_joints(random, 3.1)));
      for (std::size_t c = 0; c < placed.size(); ++c) {
        REQUIRE((body.exempt[c] != 0) == (placed[c].link <= 1));
        if (placed[c].link > 1) continue;
        for (int k = 0; k < 20; ++k) {
          const Eigen::Vector3d p = (k % 2 == 0 ? placed[c].a : placed[c].b) + placed[c].radius_m * random.direction();
          REQUIRE(p.head<2>().norm() <= body.allowance.radius_m + 1e-9);
          REQUIRE(p.z() <= body.allowance.z_high_m + 1e-9);
          REQUIRE(p.z() >= body.allowance.z_low_m - 1e-9);
        }
      }
    }
  }
  CHECK(base_allowance(*find_arm_model("ur5")).radius_m == Approx(0.30));
  CHECK(base_allowance(*find_arm_model("ur5")).z_high_m == Approx(0.25));
}

TEST_CASE("what link 1 carries beyond the allowance is not exempt") {
  const ArmModel arm = *find_arm_model("ur5");
  Body body = bare_body(arm);
  attach(body, arm, {{0, 0.3, 0}, {0, 0.4, 0}, 0.05, 1}, 2);
  CHECK(body.exempt.back() == 0);  // too high
  attach(body, arm, {{0, 0, 0.3}, {0, 0, 0.4}, 0.05, 1}, 2);
  CHECK(body.exempt.back() == 0);  // too far out
  attach(body, arm, {{0, 0, 0.1}, {0, 0, 0.2}, 0.05, 1}, 2);
  CHECK(body.exempt.back() == 1);
  CHECK(body.capsules.size() == body.levers.size());
  CHECK(body.capsules.size() == body.exempt.size());
}

TEST_CASE("the envelope is a sphere at the flange and is held apart from the arm's root") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = body_with_envelope(arm);
  const Capsule& sphere = body.capsules.back();
  CHECK(sphere.radius_m == 0.20);
  CHECK(sphere.link == 6);
  CHECK(sphere.a == sphere.b);
  const JointVector folded{0, -1.57, 2.7, 0, 1.57, 0};
  CHECK(self_margin_m(place(body.capsules, forward(arm, folded)), body.self_pairs) < 0);
  const JointVector open{0, -1.57, 0.5, 0, 1.57, 0};
  CHECK(self_margin_m(place(body.capsules, forward(arm, open)), body.self_pairs) > 0);
}

TEST_CASE("a camera that may be on any link is in an envelope on each, and joint 1 is free to turn") {
  for (const std::string_view name : {"ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e"}) {
    const ArmModel arm = *find_arm_model(name);
    const Body body = body_with_envelopes(arm, 0.15);
    for (int link = 1; link <= arm.joints; ++link) {
      const std::size_t at = arm.body.size() + static_cast<std::size_t>(link) - 1;
      CHECK(body.capsules[at].link == link);
      CHECK(body.capsules[at].radius_m == 0.15);
      CHECK((body.exempt[at] != 0) == (link == 1));
    }
  }
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = body_with_envelopes(arm);
  CHECK(self_margin_m(place(body.capsules, forward(arm, default_start(arm))), body.self_pairs) > 0);
}

TEST_CASE("the camera's capsules contain housing and cable around the mount") {
  const ArmModel arm = *find_arm_model("ur5");
  Pose mount = Pose::Identity();
  mount.rotate(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()));
  mount.translation() = Eigen::Vector3d(0.02, -0.07, 0.05);
  const CameraBody camera;
  const Body body = body_with_camera(arm, Transform<Flange, Camera>(mount), camera);
  const Capsule& housing = body.capsules[body.capsules.size() - 2];
  CHECK(housing.radius_m == Approx(camera.radius_m + camera.cable_allowance_m));
  CHECK((housing.b - housing.a).norm() == Approx(2 * camera.half_length_m));
  for (const double side : {-1.0, 1.0}) {  // the housing's own ends, along camera x
    const Eigen::Vector3d end = mount * Eigen::Vector3d(side * (camera.half_length_m + camera.radius_m), 0, 0);
    CHECK(segment_distance_m(housing.a, housing.b, end, end) <= housing.radius_m);
  }
  CHECK(self_margin_m(place(body.capsules, forward(arm, default_start(arm))), body.self_pairs) > 0);
}
