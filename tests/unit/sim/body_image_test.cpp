#include "hal/sim/body_image.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "algorithms/kinematics/self_collision.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;
using namespace firstlook::sim;

namespace {

/// Steps along the ray by the distance to the nearest capsule; infinity when it meets none within 6 m.
double march_m(const Capsules& body, const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) {
  double marched = 0;
  for (int k = 0; k < 400 && marched < 6; ++k) {
    const Eigen::Vector3d p = eye + marched * direction;
    double step = 6;
    for (const Capsule& c : body) step = std::min(step, segment_distance_m(c.a, c.b, p, p) - c.radius_m);
    marched += step;
  }
  return marched < 6 ? marched : std::numeric_limits<double>::infinity();
}

bool is_grazing(const BodyHit& hit, const Eigen::Vector3d& ray) {
  return std::abs(hit.normal.dot(ray.normalized())) < 0.05;
}

}  // namespace

TEST_CASE("a body's picture shows what marching along each ray meets, whole and band by band", "[sim][body_image]") {
  Random random(12);
  int hits = 0, misses = 0;
  for (int trial = 0; trial < 60; ++trial) {
    Capsules body;
    for (int i = 0; i < 4; ++i) {
      // Some reach behind the eye.
      const Eigen::Vector3d a(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8), random.uniform(-0.6, 1.5));
      body.push_back({a, a + 0.5 * random.normal3(), random.uniform(0.03, 0.15), i});
    }
    const Pose base_T_eye(Eigen::Translation3d(0.1 * random.normal3()) *
                          Eigen::AngleAxisd(random.uniform(-3, 3), random.direction()));
    const Eigen::Vector3d eye = base_T_eye.translation();
    Capsules seen;
    for (const Capsule& c : body) {
      if (segment_distance_m(c.a, c.b, eye, eye) > c.radius_m) seen.push_back(c);
    }
    const BodyImage image(body, base_T_eye, eye);
    for (int k = 0; k < 60; ++k) {
      const Eigen::Vector3d ray(random.uniform(-0.6, 0.6), random.uniform(-0.5, 0.5), 1);
      const double expected_m = march_m(seen, eye, (base_T_eye.linear() * ray).normalized()) / ray.norm();
      for (const BodyImage& picture : {image, image.band(ray.y() - 0.01, ray.y()), image.band(ray.y(), ray.y())}) {
        BodyHit hit;
        const bool met = picture.intersect(ray.x(), ray.y(), 10, hit);
        if (met && is_grazing(hit, ray)) continue;  // marching is slow there
        CHECK(met == std::isfinite(expected_m));
        if (!met) {
          ++misses;
          continue;
        }
        ++hits;
        CHECK(hit.depth_m == Approx(expected_m).margin(1e-3));
        CHECK(hit.normal.norm() == Approx(1));
        CHECK(hit.normal.dot(ray) < 0);
        CHECK_FALSE(picture.intersect(ray.x(), ray.y(), hit.depth_m - 1e-6, hit));
      }
    }
  }
  CHECK(hits > 500);
  CHECK(misses > 500);
}

TEST_CASE("a camera does not see the capsule that holds it, nor one that holds its projector", "[sim][body_image]") {
  Capsules body;
  body.push_back({{0, 0, -0.1}, {0, 0, 0.1}, 0.05, 1});
  body.push_back({{0.3, 0, -0.1}, {0.3, 0, 0.1}, 0.05, 2});
  BodyHit hit;
  CHECK(BodyImage(body, Pose::Identity(), {0.3, 0, 0}).empty());
  CHECK_FALSE(BodyImage(body, Pose::Identity(), {0, 0, 0}).empty());
  CHECK_FALSE(BodyImage(body, Pose::Identity(), {0, 0, 0}).intersect(0, 0, 10, hit));
}
