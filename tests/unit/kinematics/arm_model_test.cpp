#include "algorithms/kinematics/arm_model.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "algorithms/kinematics/self_collision.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;

namespace {

constexpr std::string_view kNames[] = {"ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e"};

JointVector random_joints(Random& random) {
  JointVector q = JointVector::zero(6);
  for (int j = 0; j < 6; ++j) q[j] = random.uniform(-std::numbers::pi, std::numbers::pi);
  return q;
}

/// Independent of forward(): the elementary motions of each row, multiplied out.
Pose chain(const ArmModel& arm, const JointVector& q) {
  Pose pose = Pose::Identity();
  for (int j = 0; j < arm.joints; ++j) {
    const DhRow& row = arm.dh[static_cast<std::size_t>(j)];
    pose = pose * Eigen::AngleAxisd(q[j] + row.theta_offset_rad, Eigen::Vector3d::UnitZ()) *
           Eigen::Translation3d(0, 0, row.d_m) * Eigen::Translation3d(row.a_m, 0, 0) *
           Eigen::AngleAxisd(row.alpha_rad, Eigen::Vector3d::UnitX()) *
           Eigen::AngleAxisd(row.beta_rad, Eigen::Vector3d::UnitY()) *
           Eigen::AngleAxisd(row.gamma_rad, Eigen::Vector3d::UnitZ());
  }
  return pose;
}

double distance_to_axis(const Capsule& c, const Eigen::Vector3d& p) { return segment_distance_m(c.a, c.b, p, p); }

/// A point of the surface: beside the axis, or on an end cap half of the time.
Eigen::Vector3d surface_point(const Capsule& c, Random& random) {
  const Eigen::Vector3d direction = random.direction();
  const Eigen::Vector3d axis = c.b - c.a;
  if (axis.norm() == 0) return c.a + c.radius_m * direction;
  if (random.uniform() < 0.5) return (direction.dot(axis) > 0 ? c.b : c.a) + c.radius_m * direction;
  const Eigen::Vector3d across = direction - direction.dot(axis) / axis.squaredNorm() * axis;
  return c.a + random.uniform() * axis + c.radius_m * across.normalized();
}

}  // namespace

TEST_CASE("the arms that are built in") {
  for (const std::string_view name : kNames) {
    const auto arm = find_arm_model(name);
    REQUIRE(arm);
    CHECK(arm->name == name);
    CHECK(arm->joints == 6);
    CHECK(arm->upper_rad[2] == Approx(std::numbers::pi));
  }
  CHECK_FALSE(find_arm_model("ur4"));
}

TEST_CASE("forward kinematics of a stretched UR5 is the maker's") {
  // All joints zero: the sum of the DH table along each axis.
  const Eigen::Vector3d t = forward(*find_arm_model("ur5"), JointVector::zero(6)).flange().translation();
  CHECK(t.x() == Approx(-0.425 - 0.39225));
  CHECK(t.y() == Approx(-0.10915 - 0.0823));
  CHECK(t.z() == Approx(0.089159 - 0.09465));
}

TEST_CASE("forward kinematics is the product of its elementary motions") {
  Random random(1);
  for (const std::string_view name : kNames) {
    const ArmModel arm = *find_arm_model(name);
    for (int i = 0; i < 200; ++i) {
      const JointVector q = random_joints(random);
      CHECK((forward(arm, q).flange().pose().matrix() - chain(arm, q).matrix()).cwiseAbs().maxCoeff() < 1e-14);
    }
  }
}

TEST_CASE("forward kinematics with a factory's corrections, small and large") {
  Random random(67);
  const double scale_rad = GENERATE(1e-9, 1e-3, 0.0099, 0.0101, 0.5, 3.0);
  CAPTURE(scale_rad);
  ArmModel arm = *find_arm_model("ur5e");
  for (DhRow& row : arm.dh) {
    for (double* angle_rad : {&row.alpha_rad, &row.beta_rad, &row.gamma_rad})
      *angle_rad += scale_rad * (1 - 2 * random.below(2));
  }
  for (int i = 0; i < 100; ++i) {
    const JointVector q = random_joints(random);
    CHECK((forward(arm, q).flange().pose().matrix() - chain(arm, q).matrix()).cwiseAbs().maxCoeff() < 1e-14);
  }
}

TEST_CASE("the body contains the true geometry in every configuration, end caps included") {
  Random random(2);
  for (const std::string_view name : kNames) {
    const ArmModel arm = *find_arm_model(name);
    const Capsules real = true_body(arm);
    double worst_m = -1;
    for (int i = 0; i < 2000; ++i) {
      const LinkFrames frames = forward(arm, random_joints(random));
      const Capsules body = place(arm.body, frames);
      for (const Capsule& c : place(real, frames)) {
        for (int k = 0; k < 24; ++k) {
          const Eigen::Vector3d p = surface_point(c, random);
          double outside_m = 1;
          for (const Capsule& b : body) outside_m = std::min(outside_m, distance_to_axis(b, p) - b.radius_m);
          worst_m = std::max(worst_m, outside_m);
        }
      }
    }
    INFO(name);
    CHECK(worst_m < 1e-9);
  }
}

TEST_CASE("each part of the true arm is inside the capsules of its own and the link before") {
  // What the base allowance exempts (links 0 and 1) hides nothing of links 2 and up but the upper arm's root.
  const ArmModel arm = *find_arm_model("ur5");
  Random random(3);
  const LinkFrames frames = forward(arm, random_joints(random));
  const Capsules body = place(arm.body, frames);
  for (const Capsule& c : place(true_body(arm), frames)) {
    for (int k = 0; k < 4000; ++k) {
      const Eigen::Vector3d p = surface_point(c, random);
      double outside_m = 1;
      for (const Capsule& b : body) {
        if (b.link <= c.link && b.link >= c.link - 1)
          outside_m = std::min(outside_m, distance_to_axis(b, p) - b.radius_m);
      }
      REQUIRE(outside_m < 1e-9);
    }
  }
}

TEST_CASE("the default start stands in the default safe zone with its envelope and looks outwards and down") {
  for (const std::string_view name : kNames) {
    const ArmModel arm = *find_arm_model(name);
    const LinkFrames frames = forward(arm, default_start(arm));
    const Eigen::Vector3d at = frames.flange().translation();
    const Eigen::Vector3d looks = frames.flange().rotation().col(2);
    INFO(name);
    CHECK(0.5 - at.head<2>().norm() > 0.20 + 0.01);
    CHECK(looks.z() < -0.2);
    CHECK(looks.z() > -0.6);
    CHECK(looks.head<2>().dot(at.head<2>().normalized()) > 0.8);
    CHECK(frames.flange().rotation()(2, 1) < -0.85);  // y axis down: the picture stands upright
    CHECK(self_margin_m(place(arm.body, frames), self_pairs_of_arm(arm.body, 0.005)) > 0.01);
  }
}
