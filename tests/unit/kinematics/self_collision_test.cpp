#include "algorithms/kinematics/self_collision.hpp"

#include <catch2/catch.hpp>

#include "platform/core/random.hpp"

using namespace firstlook;

namespace {

/// By alternating projection between the two segments, which converges because the distance is convex.
double iterated_distance(const Eigen::Vector3d& a0, const Eigen::Vector3d& a1, const Eigen::Vector3d& b0,
                         const Eigen::Vector3d& b1) {
  const auto nearest = [](const Eigen::Vector3d& p, const Eigen::Vector3d& s0, const Eigen::Vector3d& s1) {
    const Eigen::Vector3d d = s1 - s0;
    const double length2 = d.squaredNorm();
    return Eigen::Vector3d(s0 + d * (length2 > 0 ? std::clamp((p - s0).dot(d) / length2, 0.0, 1.0) : 0.0));
  };
  Eigen::Vector3d p = (a0 + a1) / 2;
  Eigen::Vector3d q = b0;
  for (int i = 0; i < 3000; ++i) {
    q = nearest(p, b0, b1);
    p = nearest(q, a0, a1);
  }
  return (p - q).norm();
}

}  // namespace

TEST_CASE("segment distance agrees with alternating projection") {
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    Eigen::Vector3d a0 = random.normal3();
    Eigen::Vector3d a1 = random.normal3();
    Eigen::Vector3d b0 = random.normal3();
    Eigen::Vector3d b1 = random.normal3();
    if (i % 10 == 0) a1 = a0;
    if (i % 15 == 0) b1 = b0;
    if (i % 7 == 0) b1 = b0 + (a1 - a0) * random.uniform(-2, 2);  // parallel
    const double d = segment_distance_m(a0, a1, b0, b1);
    CHECK(d == Approx(iterated_distance(a0, a1, b0, b1)).margin(2e-4));
    CHECK(d == Approx(segment_distance_m(b1, b0, a0, a1)).margin(1e-9));
  }
}

TEST_CASE("crossing segments touch, capsules overlap by their radii") {
  const Capsule a{{-1, 0, 0}, {1, 0, 0}, 0.1, 0};
  const Capsule b{{0, -1, 0}, {0, 1, 0}, 0.2, 3};
  CHECK(capsule_distance_m(a, b) == Approx(-0.3));
  const Capsule c{{2, 0, 0}, {3, 0, 0}, 0.2, 3};
  CHECK(capsule_distance_m(a, c) == Approx(0.7));
}

TEST_CASE("an arm that stands normally is free of itself, folded wrists and elbows are not") {
  const ArmModel arm = *find_arm_model("ur5");
  const SelfPairs pairs = self_pairs_of_arm(arm.body, 0.005);
  const auto margin = [&](const JointVector& q) { return self_margin_m(place(arm.body, forward(arm, q)), pairs); };
  CHECK(margin({0, -1.57, 0, -1.57, 0, 0}) > 0.01);
  CHECK(margin({0, -1.57, 1.57, -1.57, -1.57, 0}) > 0.01);
  CHECK(margin({0, -1.57, 3.1, 0, 0, 0}) < 0);      // forearm folded onto the upper arm's root
  CHECK(margin({0, -1.57, 0, 1.57, 3.14, 0}) < 0);  // hand turned back onto the forearm
}

TEST_CASE("no pair of the arm meets in every configuration") {
  Random random(2);
  for (const std::string_view name : {"ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e"}) {
    const ArmModel arm = *find_arm_model(name);
    const SelfPairs pairs = self_pairs_of_arm(arm.body, 0.005);
    FixedVector<double, kSelfPairsMax> best;
    best.resize(pairs.size());
    for (double& b : best) b = -1;
    for (int i = 0; i < 500; ++i) {
      JointVector q = JointVector::zero(6);
      for (int j = 0; j < 6; ++j) q[j] = random.uniform(-3.1, 3.1);
      const Capsules placed = place(arm.body, forward(arm, q));
      for (std::size_t p = 0; p < pairs.size(); ++p) {
        SelfPairs one;
        one.push_back(pairs[p]);
        best[p] = std::max(best[p], self_margin_m(placed, one));
      }
    }
    for (const double b : best) CHECK(b > 0.005);
  }
}
