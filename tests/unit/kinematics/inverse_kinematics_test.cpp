#include "algorithms/kinematics/inverse_kinematics.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "platform/core/random.hpp"

using namespace firstlook;

namespace {

constexpr double kPi = std::numbers::pi;

double largest_difference(const Pose& a, const Pose& b) { return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff(); }

}  // namespace

TEST_CASE("every inverse solution reaches the pose, and the joints it came from are among them") {
  Random random(1);
  for (const std::string_view name : {"ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e"}) {
    const ArmModel arm = *find_arm_model(name);
    REQUIRE(has_closed_form_inverse(arm));
    int eight = 0;
    constexpr int kPoses = 3000;
    for (int i = 0; i < kPoses; ++i) {
      JointVector q = JointVector::zero(6);
      for (int j = 0; j < 6; ++j) q[j] = random.uniform(j == 2 ? -kPi : -2 * kPi, j == 2 ? kPi : 2 * kPi);
      const auto base_T_flange = forward(arm, q).flange();
      const InverseSolutions solutions = inverse(arm, base_T_flange, q);
      double nearest = 10;
      for (const JointVector& s : solutions) {
        REQUIRE(largest_difference(forward(arm, s).flange().pose(), base_T_flange.pose()) < 1e-9);
        nearest = std::min(nearest, (s - q).max_abs());
        for (int j = 0; j < 6; ++j) {
          const auto k = static_cast<std::size_t>(j);
          REQUIRE(s[j] >= arm.lower_rad[k]);
          REQUIRE(s[j] <= arm.upper_rad[k]);
        }
      }
      INFO(name << " pose " << i << " solutions " << solutions.size());
      REQUIRE(nearest < 1e-6);
      eight += solutions.size() == 8 ? 1 : 0;
    }
    CHECK(eight > kPoses / 2);
  }
}

TEST_CASE("angles are taken nearest to the reference, within the limits") {
  const ArmModel arm = *find_arm_model("ur5");
  const JointVector q{0.3, -1.2, 1.4, -0.8, 1.1, 0.2};
  JointVector reference = q;
  reference[0] += 2 * kPi - 0.7;
  reference[5] -= 2 * kPi - 0.4;
  reference[2] += 2 * kPi;  // the elbow has no second turn
  bool found = false;
  for (const JointVector& s : inverse(arm, forward(arm, q).flange(), reference)) {
    found = found || (std::abs(s[0] - (q[0] + 2 * kPi)) < 1e-9 && std::abs(s[5] - (q[5] - 2 * kPi)) < 1e-9 &&
                      std::abs(s[2] - q[2]) < 1e-9);
  }
  CHECK_FALSE(found);  // q0 + 2 pi = 6.58 lies outside the limits of 2 pi
  reference[0] = q[0] - 2 * kPi + 0.5;
  for (const JointVector& s : inverse(arm, forward(arm, q).flange(), reference)) {
    found = found || (std::abs(s[0] - (q[0] - 2 * kPi)) < 1e-9 && std::abs(s[5] - (q[5] - 2 * kPi)) < 1e-9 &&
                      std::abs(s[2] - q[2]) < 1e-9);
  }
  CHECK(found);
}

TEST_CASE("singular wrists and stretched arms still come back") {
  const ArmModel arm = *find_arm_model("ur5");
  for (const JointVector& q : {JointVector{0.3, -1.2, 1.4, -0.8, 0, 0.7}, JointVector{0.3, -1.2, 1.4, -0.8, kPi, 0.7},
                               JointVector{0.3, -1.2, 1e-7, -0.8, 1.1, 0.7}, JointVector{0.3, -1.2, 0, -0.8, 0, 0.7}}) {
    const auto base_T_flange = forward(arm, q).flange();
    const InverseSolutions solutions = inverse(arm, base_T_flange, q);
    REQUIRE_FALSE(solutions.empty());
    double nearest = 10;
    for (const JointVector& s : solutions) {
      CHECK(largest_difference(forward(arm, s).flange().pose(), base_T_flange.pose()) < 1e-9);
      nearest = std::min(nearest, (s - q).max_abs());
    }
    CHECK(nearest < 1e-4);
  }
}

TEST_CASE("nothing is returned for what is out of reach") {
  const ArmModel arm = *find_arm_model("ur5");
  Pose far = Pose::Identity();
  far.translation() = Eigen::Vector3d(1.2, 0, 0.3);
  CHECK(inverse(arm, Transform<Base, Flange>(far), JointVector::zero(6)).empty());
  Pose inside = Pose::Identity();  // nearer to axis 1 than the arm is wide
  inside.translation() = Eigen::Vector3d(0.01, 0, 0.6);
  CHECK(inverse(arm, Transform<Base, Flange>(inside), JointVector::zero(6)).empty());
}

TEST_CASE("an arm with the factory's correction is solved on its own table") {
  Random random(2);
  ArmModel arm = *find_arm_model("ur5");
  for (std::size_t j = 0; j < 6; ++j) {
    arm.dh[j].theta_offset_rad += 0.002 * random.normal();
    arm.dh[j].alpha_rad += 0.002 * random.normal();
    arm.dh[j].a_m += 0.0005 * random.normal();
    arm.dh[j].d_m += 0.0005 * random.normal();
  }
  REQUIRE(has_closed_form_inverse(arm));
  int found = 0;
  constexpr int kPoses = 2000;
  for (int i = 0; i < kPoses; ++i) {
    JointVector q = JointVector::zero(6);
    for (int j = 0; j < 6; ++j) q[j] = random.uniform(-3, 3);
    const auto base_T_flange = forward(arm, q).flange();
    double nearest = 10;
    for (const JointVector& s : inverse(arm, base_T_flange, q)) {
      REQUIRE(largest_difference(forward(arm, s).flange().pose(), base_T_flange.pose()) < 1e-9);
      nearest = std::min(nearest, (s - q).max_abs());
    }
    found += nearest < 1e-6 ? 1 : 0;
  }
  CHECK(found > kPoses * 96 / 100);  // some of those within hundredths of a radian of a singularity are missed
}

TEST_CASE("only the UR geometry has this inverse") {
  ArmModel arm = *find_arm_model("ur5");
  arm.dh[2].alpha_rad = 0.1;
  CHECK_FALSE(has_closed_form_inverse(arm));
}
