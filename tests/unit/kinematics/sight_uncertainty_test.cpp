#include "algorithms/kinematics/sight_uncertainty.hpp"

#include <catch2/catch.hpp>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

JointVector random_joints(Random& random, double size) {
  JointVector q = JointVector::zero(6);
  for (int i = 0; i < 6; ++i) q[i] = random.uniform(-size, size);
  return q;
}

}  // namespace

TEST_CASE("the sigma of a sight is how far it scatters when stamps do", "[kinematics]") {
  const ArmModel arm = *find_arm_model("ur5");
  const Eigen::Vector3d ahead(0.02, -0.07, 1.56);
  Random random(5);
  for (int trial = 0; trial < 20; ++trial) {
    const JointVector q = random_joints(random, 2), velocity = random_joints(random, 0.5);
    const double sigma_s = random.uniform(2e-4, 2e-3);
    const Eigen::Vector3d truth = forward(arm, q).flange().pose() * ahead;
    double squares = 0;
    const int n = 2000;
    for (int i = 0; i < n; ++i) {
      const JointVector taken = q + velocity * (sigma_s * random.normal());
      squares += (forward(arm, taken).flange().pose() * ahead - truth).squaredNorm();
    }
    const double sigma_m = sight_sigma_m(forward(arm, q), ahead, {velocity, 0.008, sigma_s, 0});
    CHECK(sigma_m == Approx(std::sqrt(squares / n)).epsilon(0.08));
  }
}

TEST_CASE("reports that are far apart make a moving sight uncertain, by no less than interpolation errs",
          "[kinematics]") {
  const ArmModel arm = *find_arm_model("ur5");
  const Eigen::Vector3d ahead(0, 0, 1.5);
  Random random(6);
  const double acceleration_rad_s2 = 1.4;
  for (const double apart_s : {0.008, 0.1, 0.3}) {
    for (int trial = 0; trial < 50; ++trial) {
      const JointVector q = random_joints(random, 2), velocity = random_joints(random, 0.3);
      JointVector acceleration = JointVector::zero(6);
      for (int i = 0; i < 6; ++i) acceleration[i] = random.uniform(-acceleration_rad_s2, acceleration_rad_s2);
      const auto at = [&](double t) { return q + velocity * t + acceleration * (t * t / 2); };
      const JointVector before = at(-apart_s / 2), after = at(apart_s / 2), between = interpolate(before, after, 0.5);
      const double error_m =
          ((forward(arm, between).flange().pose() * ahead) - (forward(arm, q).flange().pose() * ahead)).norm();
      const double sigma_m = sight_sigma_m(forward(arm, between), ahead,
                                           {(after - before) * (1 / apart_s), apart_s, 0, acceleration_rad_s2});
      REQUIRE(error_m < 1.05 * sigma_m);
    }
  }
}

TEST_CASE("an arm that stands is certain of its sight, whatever the stamps are", "[kinematics]") {
  const ArmModel arm = *find_arm_model("ur5");
  const JointVector q = default_start(arm);
  CHECK(sight_sigma_m(forward(arm, q), {0, 0, 1.5}, {JointVector::zero(6), 0.5, 0.1, 1.4}) == 0);
}

}  // namespace firstlook
