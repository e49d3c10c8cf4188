#include "algorithms/mapping/self_filter.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

const CameraIntrinsics kCamera = {64, 48, 55, 56, 31, 24.5};

std::vector<float> render(std::span<const Capsule> body, double padding_m, const Transform<Base, Depth>& pose) {
  std::vector<float> depth_m(64 * 48);
  render_self_depth(body, padding_m, pose, kCamera, depth_m);
  return depth_m;
}

double distance_m(const Capsule& c, const Eigen::Vector3d& p) {
  const Eigen::Vector3d ab = c.b - c.a;
  const double t = ab.squaredNorm() > 0 ? std::clamp((p - c.a).dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0.0;
  return (c.a + t * ab - p).norm() - c.radius_m;
}

// Marches along the pixel's ray until the body is reached.
double march(std::span<const Capsule> body, double padding_m, const Transform<Base, Depth>& pose, int u, int v) {
  const Eigen::Vector3d ray((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1);
  double z_m = 0;
  while (z_m < 20) {
    double nearest_m = 1;
    for (const Capsule& c : body) nearest_m = std::min(nearest_m, distance_m(c, pose * (z_m * ray)) - padding_m);
    if (nearest_m < 1e-7) return z_m;
    z_m += nearest_m / ray.norm();
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

TEST_CASE("the body's depth is where the pixel's ray enters it", "[mapping][self_filter]") {
  Random random(6);
  int seen = 0;
  for (int round = 0; round < 40; ++round) {
    const Transform<Base, Depth> pose(random.rotation(), random.normal3());
    std::vector<Capsule> body;
    for (int i = 0; i < 3; ++i) {
      Capsule c;
      // Some in front, some beside, behind, or across the sensor's plane; one is a sphere.
      c.a = pose * Eigen::Vector3d(random.normal3() + Eigen::Vector3d(0, 0, 0.7));
      c.b = i == 2 ? c.a : Eigen::Vector3d(c.a + 0.6 * random.normal3());
      c.radius_m = random.uniform(0.03, 0.15);
      if (distance_m(c, pose.translation()) > 0.05) body.push_back(c);
    }
    const std::vector<float> depth_m = render(body, 0.02, pose);
    for (int v = 0; v < 48; v += 3) {
      for (int u = 0; u < 64; u += 3) {
        const double expected_m = march(body, 0.02, pose, u, v);
        const double ours_m = static_cast<double>(depth_m[static_cast<std::size_t>(v * 64 + u)]);
        if (std::isinf(expected_m) != std::isinf(ours_m)) {
          // A ray that grazes the surface may count either way: a hair more padding settles it.
          REQUIRE_FALSE(std::isinf(march(body, 0.02 + 1e-5, pose, u, v)));
          continue;
        }
        if (std::isinf(ours_m)) continue;
        ++seen;
        REQUIRE(ours_m == Approx(expected_m).margin(2e-3));
      }
    }
  }
  CHECK(seen > 200);
}

TEST_CASE("every pixel of the body's image is covered", "[mapping][self_filter]") {
  // Points of the true, unpadded surface project into pixels whose body begins at or before them.
  Random random(9);
  const Transform<Base, Depth> pose(random.rotation(), random.normal3());
  Capsule c;
  c.a = pose * Eigen::Vector3d(-0.1, 0.05, 0.4);
  c.b = pose * Eigen::Vector3d(0.25, -0.2, 1.1);
  c.radius_m = 0.06;
  const std::vector<float> depth_m = render(std::span(&c, 1), 0.02, pose);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d p_m = c.a + (c.b - c.a) * random.uniform() + c.radius_m * random.direction();
    const Eigen::Vector3d q = pose.inverse() * p_m;
    const long u = std::lround(q.x() / q.z() * kCamera.fx + kCamera.cx),
               v = std::lround(q.y() / q.z() * kCamera.fy + kCamera.cy);
    if (u < 0 || v < 0 || u >= 64 || v >= 48) continue;
    ++inside;
    REQUIRE(static_cast<double>(depth_m[static_cast<std::size_t>(v * 64 + u)]) <= q.z());
  }
  CHECK(inside > 5000);
}

TEST_CASE("a capsule that holds the sensor does not blind it", "[mapping][self_filter]") {
  const Transform<Base, Depth> pose(Eigen::Quaterniond::Identity(), {1, 2, 3});
  Capsule housing;
  housing.a = housing.b = {1, 2, 2.99};
  housing.radius_m = 0.05;
  for (const float z_m : render(std::span(&housing, 1), 0.02, pose)) REQUIRE(std::isinf(z_m));
  // Padding alone reaches the sensor: the capsule itself still counts.
  Capsule gripper;
  gripper.a = {1, 2.06, 3};
  gripper.b = {1, 2.06, 3.3};
  gripper.radius_m = 0.05;
  const std::vector<float> depth_m = render(std::span(&gripper, 1), 0.02, pose);
  CHECK(std::isfinite(depth_m[47 * 64 + 31]));
  CHECK(std::isinf(depth_m[0 * 64 + 31]));
}

TEST_CASE("no body, or one behind the sensor, hides nothing", "[mapping][self_filter]") {
  const Transform<Base, Depth> pose;
  for (const float z_m : render({}, 0.02, pose)) REQUIRE(std::isinf(z_m));
  Capsule behind;
  behind.a = {0, 0, -1};
  behind.b = {0.3, 0, -0.5};
  behind.radius_m = 0.1;
  for (const float z_m : render(std::span(&behind, 1), 0.02, pose)) REQUIRE(std::isinf(z_m));
}

}  // namespace firstlook
