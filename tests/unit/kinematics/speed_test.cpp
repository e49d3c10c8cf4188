#include "algorithms/kinematics/speed.hpp"

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

/// Largest speed of sampled surface points between two instants, by differences of positions.
double sampled_speed(const ArmModel& arm, const SegmentTiming& timing, double t_s, double dt_s,
                     const std::array<Eigen::Vector3d, 12>& directions) {
  const LinkFrames before = forward(arm, timing.position_at(t_s));
  const LinkFrames after = forward(arm, timing.position_at(t_s + dt_s));
  double fastest = 0;
  for (const Capsule& c : arm.body) {
    const auto link = static_cast<std::size_t>(c.link);
    for (const Eigen::Vector3d& d : directions) {
      for (const Eigen::Vector3d& end : {c.a, c.b}) {
        const Eigen::Vector3d p = end + c.radius_m * d;
        fastest = std::max(fastest, (after.base_T_link[link] * p - before.base_T_link[link] * p).norm() / dt_s);
      }
    }
  }
  return fastest;
}

}  // namespace

TEST_CASE("no point of the body exceeds the speed limit, and the move is not needlessly slow") {
  Random random(1);
  std::array<Eigen::Vector3d, 12> directions;
  for (Eigen::Vector3d& d : directions) d = random.direction();
  const ArmModel arm = *find_arm_model("ur5");
  SpeedLimits limits;
  limits.joint_speed_rad_s = 3;
  double share = 0;
  int cruising = 0;
  for (int i = 0; i < 300; ++i) {
    const JointVector from = random_joints(random, std::numbers::pi);
    const JointVector to = from + random_joints(random, 1.5);
    const SegmentTiming timing = time_segment(arm, arm.body, from, to, limits);
    double peak = 0;
    for (int k = 0; k < 150; ++k) {
      peak =
          std::max(peak, sampled_speed(arm, timing, timing.duration_s * k / 150, timing.duration_s / 1500, directions));
    }
    REQUIRE(peak <= 0.25 + 1e-9);
    REQUIRE(peak <= timing.body_speed_bound_m_s + 1e-9);
    share += peak / 0.25;
    ++cruising;
  }
  CHECK(share / cruising > 0.85);
}

TEST_CASE("a move starts and ends at rest, in time, and respects the joints' limits") {
  Random random(2);
  const ArmModel arm = *find_arm_model("ur10");
  for (int i = 0; i < 200; ++i) {
    const JointVector from = random_joints(random, 2);
    const JointVector to = from + random_joints(random, i % 2 == 0 ? 2.0 : 0.02);
    SpeedLimits limits;
    limits.body_speed_m_s = i % 3 == 0 ? 100 : 0.25;
    limits.joint_speed_rad_s = 10;
    limits.joint_acceleration_rad_s2 = 1.4;
    const SegmentTiming timing = time_segment(arm, arm.body, from, to, limits);
    CHECK(timing.position_at(0) == from);
    CHECK((timing.position_at(timing.duration_s) - to).max_abs() < 1e-12);
    CHECK((timing.position_at(timing.duration_s + 1) - to).max_abs() < 1e-12);
    double before = -1e-12;
    double integral = 0;
    constexpr int kSteps = 2000;
    for (int k = 0; k < kSteps; ++k) {
      const double t_s = timing.duration_s * (k + 0.5) / kSteps;
      const double s = timing.fraction_at(t_s);
      REQUIRE(s >= before);
      before = s;
      const JointVector speed = timing.velocity_at(t_s);
      integral += timing.fraction_rate_at(t_s) * timing.duration_s / kSteps;
      for (int j = 0; j < 6; ++j)
        REQUIRE(std::abs(speed[j]) <= arm.speed_max_rad_s[static_cast<std::size_t>(j)] + 1e-9);
      REQUIRE(speed.max_abs() <= timing.leading_acceleration_rad_s2 * t_s + 1e-9);
    }
    CHECK(integral == Approx(1).margin(1e-3));
  }
}

TEST_CASE("a base turn of a stretched arm is limited by its farthest point") {
  const ArmModel arm = *find_arm_model("ur5");
  const JointVector from{0, 0, 0, 0, 0, 0};
  const JointVector to{1, 0, 0, 0, 0, 0};
  // The end cap of the hand, from axis 1: hypot of the flange's place, and the radius.
  const double lever_m = std::hypot(0.425 + 0.39225, 0.10915 + 0.0823) + 0.05;
  const double bound = speed_bound_m_per_unit(arm, arm.body, from, to);
  CHECK(bound >= lever_m - 1e-9);
  CHECK(bound <= 1.031 * lever_m);
}

TEST_CASE("the least duration is no more than the duration, and near it") {
  Random random(5);
  const ArmModel arm = *find_arm_model("ur5");
  double share = 0;
  constexpr int kSegments = 2000;
  for (int i = 0; i < kSegments; ++i) {
    const JointVector from = random_joints(random, std::numbers::pi);
    const JointVector to = from + random_joints(random, i % 2 == 0 ? 1.5 : 0.1);
    const double duration_s = time_segment(arm, arm.body, from, to, {}).duration_s;
    const double least_s = least_duration_s(arm, arm.body, from, to, {});
    REQUIRE(least_s <= duration_s * (1 + 1e-12));
    share += least_s / duration_s / kSegments;
  }
  CHECK(share > 0.9);
  const JointVector q = random_joints(random, 1);
  CHECK(least_duration_s(arm, arm.body, q, q, {}) == 0);
}

TEST_CASE("a segment of no length takes no time") {
  const ArmModel arm = *find_arm_model("ur5");
  const JointVector q = default_start(arm);
  const SegmentTiming timing = time_segment(arm, arm.body, q, q, {});
  CHECK(timing.duration_s == 0);
  CHECK(timing.position_at(0.1) == q);
  CHECK(speed_bound_m_per_unit(arm, arm.body, q, q) == 0);
}
