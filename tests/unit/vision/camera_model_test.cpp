#include "algorithms/vision/camera_model.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "platform/core/random.hpp"

using namespace firstlook;

namespace {
// The thesis's webcam and Kinect at 640x480.
constexpr CameraIntrinsics kWebcam{640, 480, 534.78, 534.10, 308.63, 226.92, .04586, -.1301, .0025, -.0006, 0};
constexpr CameraIntrinsics kKinect{640, 480, 537.33, 538.35, 321.61, 252.18, .17938, -.31818, -.00268, .00209, 0};
}  // namespace

TEST_CASE("a pixel and back through undistort", "[vision]") {
  for (const CameraIntrinsics& camera : {kWebcam, kKinect}) {
    for (int v = 0; v < 480; v += 7) {
      for (int u = 0; u < 640; u += 7) {
        const auto ray = undistort(camera, {u, v});
        REQUIRE(ray);
        const auto pixel = project(camera, Eigen::Vector3d(2.5 * ray->x(), 2.5 * ray->y(), 2.5));
        REQUIRE(pixel);
        CHECK((*pixel - Eigen::Vector2d(u, v)).norm() < 1e-9);
      }
    }
  }
}

TEST_CASE("distortion as Brown's formula gives it", "[vision]") {
  // By hand for x = 0.3, y = -0.2: r2 = 0.13.
  const Eigen::Vector2d d = distort(kKinect, {0.3, -0.2});
  const double radial = 1 + .17938 * .13 - .31818 * .13 * .13;
  CHECK(d.x() == Approx(.3 * radial + 2 * -.00268 * .3 * -.2 + .00209 * (.13 + 2 * .09)));
  CHECK(d.y() == Approx(-.2 * radial + -.00268 * (.13 + 2 * .04) + 2 * .00209 * .3 * -.2));
}

TEST_CASE("derivatives by the intrinsics agree with differences", "[vision]") {
  Random random(4);
  const CameraIntrinsics camera{640, 480, 537.33, 538.35, 321.61, 252.18, .17938, -.31818, -.00268, .00209, .05};
  const auto pixel = [](const CameraIntrinsics& c, const Eigen::Vector2d& p) {
    return project(c, Eigen::Vector3d(p.x(), p.y(), 1)).value();
  };
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d normalized(random.uniform(-.5, .5), random.uniform(-.4, .4));
    const IntrinsicsJacobian j = intrinsics_jacobian(camera, normalized);
    for (int number = 0; number < 9; ++number) {
      const double step = number < 4 ? 1e-3 : 1e-6;
      const IntrinsicsVector change = step * IntrinsicsVector::Unit(number);
      const CameraIntrinsics up = with_intrinsics(camera, intrinsics_vector(camera) + change);
      const CameraIntrinsics down = with_intrinsics(camera, intrinsics_vector(camera) - change);
      const Eigen::Vector2d slope = (pixel(up, normalized) - pixel(down, normalized)) / (2 * step);
      CHECK((slope - j.col(number)).norm() < 1e-5);
    }
  }
  CHECK(with_intrinsics(camera, intrinsics_vector(camera)) == camera);
}

TEST_CASE("derivatives agree with differences", "[vision]") {
  Random random(3);
  constexpr double kStep = 1e-6;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Vector3d p(random.uniform(-.4, .4), random.uniform(-.3, .3), random.uniform(.5, 2));
    const auto at = project_with_jacobian(kKinect, p);
    REQUIRE(at);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector2d slope = (*project(kKinect, p + step) - *project(kKinect, p - step)) / (2 * kStep);
      CHECK((slope - at->d_pixel_d_point.col(axis)).norm() < 1e-5);
    }
  }
}

TEST_CASE("points without an image", "[vision]") {
  CHECK_FALSE(project(kWebcam, {0.1, 0.1, -1}));
  CHECK_FALSE(project(kWebcam, {0.1, 0.1, 0}));
  CHECK_FALSE(project(kWebcam, {std::nan(""), 0, 1}));
  CHECK(project(kWebcam, {0, 0, 1})->isApprox(Eigen::Vector2d(308.63, 226.92)));
}

TEST_CASE("a point beyond the fold of the distortion is not drawn into the picture", "[vision]") {
  // k2 = -0.318 folds back at r near 1.1: at r = 2.0 the polynomial alone would give a negative radius.
  const double r = 2.0;
  const double folded = r * (1 + .17938 * r * r - .31818 * r * r * r * r);
  REQUIRE(std::abs(folded) * 537 > 0);
  CHECK_FALSE(project(kKinect, {r, 0, 1}));
  CHECK_FALSE(project(kKinect, {1.75, 0, 1}));
  CHECK(project(kKinect, {0.7, 0, 1}));
  CHECK_FALSE(undistort(kKinect, {5000, 252}));
}

TEST_CASE("margins of the image", "[vision]") {
  CHECK(in_image(kWebcam, {0, 0}));
  CHECK(in_image(kWebcam, {639, 479}));
  CHECK_FALSE(in_image(kWebcam, {639.1, 479}));
  CHECK_FALSE(in_image(kWebcam, {20, 240}, 25));
}
