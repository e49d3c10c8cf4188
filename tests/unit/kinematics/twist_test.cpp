#include "algorithms/kinematics/twist.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "platform/core/random.hpp"

using namespace firstlook;

namespace {

JointVector random_joints(Random& random, double range) {
  JointVector q = JointVector::zero(6);
  for (int j = 0; j < 6; ++j) q[j] = random.uniform(-range, range);
  return q;
}

}  // namespace

TEST_CASE("link twists are the derivative of the body's points, and its second derivative stays in its bound") {
  Random random(1);
  for (const std::string_view name : {"ur5", "ur10e"}) {
    const ArmModel arm = *find_arm_model(name);
    double tightest = 0;
    for (int i = 0; i < 500; ++i) {
      const JointVector q = random_joints(random, std::numbers::pi);
      const JointVector dq = random_joints(random, 1);
      constexpr double kStep = 1e-4;
      const LinkFrames frames = forward(arm, q);
      const Capsules at = place(arm.body, frames);
      const Capsules before = place(arm.body, forward(arm, q - dq * kStep));
      const Capsules after = place(arm.body, forward(arm, q + dq * kStep));
      const LinkTwists twists = link_twists(frames, dq);
      for (std::size_t c = 0; c < at.size(); ++c) {
        const Eigen::Vector3d velocity = (after[c].b - before[c].b) / (2 * kStep);
        CHECK((velocity - twists.velocity(at[c].link, at[c].b)).norm() < 1e-6);
        const double second = (after[c].b - 2 * at[c].b + before[c].b).norm() / (kStep * kStep);
        const double bound = second_derivative_bound(lever_arms(arm, arm.body[c]), arm.body[c].link, dq);
        CHECK(second <= bound + 1e-5);
        if (bound > 0) tightest = std::max(tightest, second / bound);
      }
    }
    CHECK(tightest > 0.5);  // a bound that is far too large would be useless
  }
}

TEST_CASE("no point of a capsule's axis is farther from a joint's axis than its lever arm") {
  Random random(2);
  const ArmModel arm = *find_arm_model("ur5");
  std::array<double, 6> largest{};
  const Capsule& hand = arm.body.back();
  const LeverArms levers = lever_arms(arm, hand);
  for (int i = 0; i < 20000; ++i) {
    const LinkFrames frames = forward(arm, random_joints(random, std::numbers::pi));
    for (const Capsule& c : place(arm.body, frames)) {
      const LeverArms reach = lever_arms(arm, [&] {
        Capsule local = c;
        const Pose link_T_base = frames.base_T_link[static_cast<std::size_t>(c.link)].inverse(Eigen::Isometry);
        local.a = link_T_base * c.a;
        local.b = link_T_base * c.b;
        return local;
      }());
      for (int k = 0; k < c.link; ++k) {
        const Pose& joint = frames.base_T_link[static_cast<std::size_t>(k)];
        const double off = std::max((joint.inverse(Eigen::Isometry) * c.a).head<2>().norm(),
                                    (joint.inverse(Eigen::Isometry) * c.b).head<2>().norm());
        REQUIRE(off <= reach[static_cast<std::size_t>(k)] + 1e-9);
        if (c.link == 6) largest[static_cast<std::size_t>(k)] = std::max(largest[static_cast<std::size_t>(k)], off);
      }
      for (int k = c.link; k < 6; ++k) REQUIRE(reach[static_cast<std::size_t>(k)] == 0);
    }
  }
  for (std::size_t k = 0; k < 5; ++k) CHECK(largest[k] > 0.7 * levers[k]);  // and not far below it
}
