#include "algorithms/kinematics/numeric_inverse.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <numbers>

#include "algorithms/kinematics/joint_chain.hpp"
#include "algorithms/kinematics/other_arms.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;

namespace {

JointVector random_within(const ArmModel& arm, Random& random, double share = 1) {
  JointVector q = JointVector::zero(arm.joints);
  for (int j = 0; j < arm.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    const double low = std::max(arm.lower_rad[i], -std::numbers::pi),
                 high = std::min(arm.upper_rad[i], std::numbers::pi);
    const double middle = (low + high) / 2, half = share * (high - low) / 2;
    q[j] = random.uniform(middle - half, middle + half);
  }
  return q;
}

double apart(const Pose& a, const Pose& b) { return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff(); }

bool within_limits(const ArmModel& arm, const JointVector& q) {
  for (int j = 0; j < arm.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    if (q[j] < arm.lower_rad[i] || q[j] > arm.upper_rad[i]) return false;
  }
  return true;
}

/// Angles that differ by whole turns are one posture.
bool same_posture(const JointVector& a, const JointVector& b) {
  for (int j = 0; j < a.size(); ++j) {
    if (std::abs(std::remainder(a[j] - b[j], 2 * std::numbers::pi)) > 1e-3) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("from many starts the numeric solver finds what the closed form of a UR has") {
  Random random(1);
  int poses = 0, none = 0, closed = 0, found = 0;
  for (const std::string_view name : {"ur3", "ur5", "ur10e"}) {
    const ArmModel arm = *find_arm_model(name);
    for (int i = 0; i < 60; ++i) {
      const JointVector q = random_within(arm, random);
      const Transform<Base, Flange> pose = forward(arm, q).flange();
      const JointVector reference = JointVector::zero(6);
      const InverseSolutions exact = inverse(arm, pose, reference);
      const InverseSolutions numeric = inverse_numeric(arm, pose, reference, {.starts_max = 200, .iterations_max = 80});
      ++poses;
      none += numeric.empty() ? 1 : 0;
      for (const JointVector& s : numeric) {
        REQUIRE(within_limits(arm, s));
        REQUIRE(apart(forward(arm, s).flange().pose(), pose.pose()) < 2e-9);
        // No seventh joint: what solves it is one of the closed form's.
        CHECK(std::any_of(exact.begin(), exact.end(), [&](const JointVector& e) { return same_posture(e, s); }));
      }
      for (const JointVector& e : exact) {
        ++closed;
        found += std::any_of(numeric.begin(), numeric.end(), [&](const JointVector& s) { return same_posture(e, s); });
      }
    }
  }
  INFO(poses << " poses, " << none << " without a solution, " << found << " of " << closed << " postures found");
  CHECK(none == 0);
  CHECK(found > 0.95 * closed);
}

TEST_CASE("the usual number of starts finds some posture of nearly every pose") {
  Random random(2);
  for (const std::string_view name : {"ur5", "pr2_like"}) {
    const ArmModel arm = *find_arm_model(name);
    int found = 0;
    constexpr int kPoses = 200;
    for (int i = 0; i < kPoses; ++i) {
      const Transform<Base, Flange> pose = forward(arm, random_within(arm, random, 0.95)).flange();
      const InverseSolutions solutions = inverse_numeric(arm, pose, default_start(arm));
      found += solutions.empty() ? 0 : 1;
      for (const JointVector& s : solutions) {
        REQUIRE(within_limits(arm, s));
        REQUIRE(apart(forward(arm, s).flange().pose(), pose.pose()) < 2e-9);
      }
    }
    INFO(name << ": " << found << " of " << kPoses);
    CHECK(found >= 0.97 * kPoses);
  }
}

TEST_CASE("the reference is the first start, and angles come as near to it as whole turns allow") {
  const ArmModel arm = *find_arm_model("ur5");
  JointVector q{0.3, -1.2, 1.4, -0.7, 1.0, 0.5};
  JointVector reference = q + JointVector{0.05, -0.05, 0.05, 0.05, -0.05, 0.05};
  const InverseSolutions solutions = inverse_numeric(arm, forward(arm, q).flange(), reference, {.starts_max = 1});
  REQUIRE(solutions.size() == 1);
  CHECK((solutions[0] - q).max_abs() < 1e-8);
  reference[5] = 3.0;  // half a turn to either side lies within the limits
  for (const JointVector& s : inverse_numeric(arm, forward(arm, q).flange(), reference)) {
    CHECK(std::abs(s[5] - reference[5]) <= std::numbers::pi + 1e-9);
  }
}

TEST_CASE("equal arguments give equal bytes, and what is out of reach has no solution") {
  const ArmModel arm = *find_arm_model("pr2_like");
  Random random(3);
  const Transform<Base, Flange> pose = forward(arm, random_within(arm, random)).flange();
  const InverseSolutions a = inverse_numeric(arm, pose, default_start(arm));
  const InverseSolutions b = inverse_numeric(arm, pose, default_start(arm));
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) CHECK(a[i] == b[i]);
  Pose far = Pose::Identity();
  far.translation() = Eigen::Vector3d(3, 0, 0);
  CHECK(inverse_numeric(arm, Transform<Base, Flange>(far), default_start(arm)).empty());
}

TEST_CASE("an arm with few joints looks at a point from as near as it gets") {
  const ArmModel arm = *find_arm_model("two_joint");
  const Pose flange_T_sensor = Pose(Eigen::Translation3d(0, -0.275, -0.6));
  Random random(4);
  int found = 0;
  constexpr int kTargets = 100;
  for (int i = 0; i < kTargets; ++i) {
    const JointVector q = random_within(arm, random, 0.9);
    const Pose truth = forward(arm, q).flange().pose() * flange_T_sensor;
    const Eigen::Vector3d target = truth * Eigen::Vector3d(0, 0, 1.5);
    // Asked from a pose that it cannot have: rolled, and a little beside.
    Pose asked = truth * Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ());
    const InverseSolutions solutions = inverse_looking(arm, flange_T_sensor, asked, 1.5, default_start(arm));
    found += solutions.empty() ? 0 : 1;
    for (const JointVector& s : solutions) {
      const Pose sensor = forward(arm, s).flange().pose() * flange_T_sensor;
      const Eigen::Vector3d seen = sensor.inverse(Eigen::Isometry) * target;
      CHECK(seen.z() > 0);
      CHECK(seen.head<2>().norm() < 0.01 * seen.norm());
    }
  }
  CHECK(found >= 95);
}

TEST_CASE("with six joints or more looking is reaching the pose") {
  const ArmModel arm = *find_arm_model("pr2_like");
  const Pose flange_T_sensor = Pose(Eigen::Translation3d(0, -0.07, 0.06));
  const Pose sensor = forward(arm, default_start(arm)).flange().pose() * flange_T_sensor;
  const InverseSolutions solutions = inverse_looking(arm, flange_T_sensor, sensor, 1.0, default_start(arm));
  REQUIRE_FALSE(solutions.empty());
  for (const JointVector& s : solutions) {
    CHECK(apart(forward(arm, s).flange().pose() * flange_T_sensor, sensor) < 2e-9);
  }
}
