#include "algorithms/kinematics/capsule_fit.hpp"

#include <catch2/catch.hpp>
#include <numbers>
#include <vector>

#include "algorithms/kinematics/self_collision.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;
using Eigen::Vector3d;

namespace {

/// Independent of the fit: the distance of a point from a segment by sampling it finely is never below the true one.
double sampled_distance_m(const Capsule& c, const Vector3d& p) {
  double least = 1e9;
  for (int i = 0; i <= 2000; ++i) least = std::min(least, (c.a + (c.b - c.a) * (i / 2000.0) - p).norm());
  return least;
}

double volume(const Capsule& c) {
  return std::numbers::pi * c.radius_m * c.radius_m * ((c.b - c.a).norm() + 4 * c.radius_m / 3);
}

}  // namespace

TEST_CASE("a fitted capsule holds every point") {
  Random random(1);
  for (int shape = 0; shape < 60; ++shape) {
    const Eigen::Quaterniond turn = random.rotation();
    const Vector3d at = random.normal3();
    const Vector3d half(random.uniform(0.01, 0.3), random.uniform(0.01, 0.1), random.uniform(0.005, 0.1));
    std::vector<Vector3d> points;
    const int n = shape < 5 ? shape + 1 : 200;
    for (int i = 0; i < n; ++i) {
      points.push_back(at + turn * Vector3d(half.x() * random.uniform(-1, 1), half.y() * random.uniform(-1, 1),
                                            half.z() * random.uniform(-1, 1)));
    }
    const Capsule c = fit_capsule(points, 3);
    CHECK(c.link == 3);
    CHECK(farthest_outside_m(c, points) <= 0);
    for (const Vector3d& p : points) REQUIRE(sampled_distance_m(c, p) <= c.radius_m + 1e-5);
  }
}

TEST_CASE("the capsule of a capsule's own points is hardly larger") {
  Random random(2);
  for (int shape = 0; shape < 20; ++shape) {
    const Capsule truth{random.normal3(), random.normal3(), random.uniform(0.03, 0.3), 0};
    std::vector<Vector3d> points;
    for (int i = 0; i < 1500; ++i) {
      const Vector3d d = random.direction();
      const Vector3d axis = (truth.b - truth.a).normalized();
      points.push_back((d.dot(axis) > 0 ? truth.b : truth.a) + truth.radius_m * d);
    }
    CHECK(volume(fit_capsule(points, 0)) < 1.15 * volume(truth));
  }
}

TEST_CASE("a long box gets a capsule along it") {
  std::vector<Vector3d> points;
  for (int corner = 0; corner < 8; ++corner) {
    points.emplace_back((corner & 1 ? 0.4 : -0.4), (corner & 2 ? 0.03 : -0.03), (corner & 4 ? 0.04 : -0.04));
  }
  const Capsule c = fit_capsule(points, 0);
  CHECK((c.b - c.a).normalized().cross(Vector3d::UnitX()).norm() < 1e-6);
  CHECK(c.radius_m < 0.075);
  CHECK(c.radius_m >= 0.05);
}
