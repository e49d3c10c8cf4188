#include "algorithms/calibration/depth_to_color.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <string>

#include "tests/support/sanitized_builds.hpp"
#include "tests/unit/calibration/synthetic_depth.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using test::DepthSetup;

namespace {

constexpr double kSigma_m = 0.005, kSigma_rad = 0.010, kSigmaScale = 0.01;

DepthMount factory() {
  return believed_mount(Transform<Camera, Depth>(Eigen::Quaterniond::Identity(), {-0.025, 0, 0}), kSigma_m, kSigma_rad,
                        kSigmaScale);
}

/// A camera that differs from its sheet as the sheet's sigmas say.
DepthSetup drawn(Random& random) {
  DepthSetup s;
  Vector6d off;
  off << kSigma_m * random.normal3(), kSigma_rad * random.normal3();
  s.camera_T_depth = perturb(s.camera_T_depth, off);
  s.depth_scale = 1 + kSigmaScale * random.normal();
  return s;
}

std::vector<DepthStop> observe_stops(const DepthSetup& s, int count, Random& random) {
  std::vector<DepthStop> stops;
  for (int i = 0; i < count; ++i) {
    stops.push_back(
        test::observe_stop(s, test::random_camera_T_board(s.color, random), factory().camera_T_depth.pose(), random));
  }
  return stops;
}

Vector7d error_of(const DepthSetup& s, const DepthMount& mount) {
  Vector7d error;
  error << pose_difference(s.camera_T_depth, mount.camera_T_depth.pose()), s.depth_scale - mount.depth_scale;
  return error;
}

DepthToColor estimated(std::span<const DepthStop> stops) {
  const auto result = estimate_depth_to_color(stops, factory());
  if (!result) FAIL(result.error().detail());
  return *result;
}

std::vector<std::string> names(const DepthToColor& result) {
  std::vector<std::string> list;
  for (const UntoldDirection& direction : result.untold) list.push_back(direction.name);
  return list;
}

/// Stops that all see the board's plane at these tilts (rad, about x and y) and distances.
struct Place {
  double about_x, about_y, distance_m;
};
std::vector<DepthStop> stops_at(const DepthSetup& s, const std::vector<Place>& places, Random& random) {
  std::vector<DepthStop> stops;
  for (const Place& place : places) {
    Pose pose = Pose::Identity();
    pose.linear() = rotation_exp({place.about_x, place.about_y, 0});
    pose.translation() = Eigen::Vector3d(0, 0, place.distance_m) - pose.linear() * s.color.board.center();
    stops.push_back(test::observe_stop(s, pose, factory().camera_T_depth.pose(), random));
  }
  return stops;
}

}  // namespace

TEST_CASE("the depth camera is found as sure as the covariance says", "[calibration]") {
  constexpr int kTrials = test::trials(150);
  Random random(21);
  double nees = 0, belief = 0;
  int contradicted = 0;
  Vector7d squares = Vector7d::Zero(), variances = Vector7d::Zero();
  for (int trial = 0; trial < kTrials; ++trial) {
    const DepthSetup s = drawn(random);
    const DepthToColor result = estimated(observe_stops(s, 15, random));
    const Vector7d error = error_of(s, result.mount);
    nees += error.dot(result.mount.covariance.inverse() * error) / kTrials;
    belief += result.belief.chi2 / result.belief.degrees_of_freedom / kTrials;
    contradicted += result.belief.contradicted() ? 1 : 0;
    squares += error.cwiseAbs2() / kTrials;
    variances += result.mount.covariance.diagonal() / kTrials;
    CHECK(result.untold.empty());
    CHECK(result.noise_at_1m == Approx(s.noise_at_1m).epsilon(0.08));  // with the rounding to millimetres
  }
  INFO("rms " << squares.cwiseSqrt().transpose() << ", sigma " << variances.cwiseSqrt().transpose());
  // 7 expected; standard deviation of the mean of 150 trials 0.31.
  CHECK(nees > 7 - 1.2);
  CHECK(nees < 7 + 1.2);
  CHECK(belief == Approx(1).margin(0.2));
  CHECK(contradicted <= 2);
  CHECK(squares.head<3>().cwiseSqrt().maxCoeff() < 1.5e-3);
  CHECK(squares.segment<3>(3).cwiseSqrt().maxCoeff() < 1e-3);
}

TEST_CASE("5 mm and 10 mrad that the factory does not know of are found within 3 sigma", "[calibration]") {
  Random random(22);
  DepthSetup s;
  Vector6d off;
  off << 0.003, -0.003, 0.0026, 0.006, 0.006, -0.0053;
  s.camera_T_depth = perturb(s.camera_T_depth, off);
  const DepthToColor result = estimated(observe_stops(s, 15, random));
  const Vector7d error = error_of(s, result.mount), sigma = result.mount.covariance.diagonal().cwiseSqrt();
  for (int k = 0; k < 7; ++k) CHECK(std::abs(error[k]) < 3 * sigma[k]);
  CHECK((result.moved - off).head<3>().norm() < 0.003);
  CHECK(result.offset_rms_m < 0.001);
}

TEST_CASE("a factory pose that is far wrong is contradicted", "[calibration]") {
  Random random(23);
  DepthSetup s;
  Vector6d off = Vector6d::Zero();
  off[2] = 0.02;  // four of its sigmas
  off[3] = 0.03;
  s.camera_T_depth = perturb(s.camera_T_depth, off);
  const DepthToColor result = estimated(observe_stops(s, 15, random));
  CHECK(result.belief.contradicted());
  CHECK(result.belief.degrees_of_freedom == 7);
  CHECK(error_of(s, result.mount).head<3>().norm() < 0.004);
}

TEST_CASE("directions that the boards do not tell stay as believed and are named", "[calibration]") {
  Random random(24);
  DepthSetup s;
  s.camera_T_depth = perturb(s.camera_T_depth, (Vector6d() << 0.004, 0, 0.003, 0, 0.005, 0.01).finished());
  SECTION("boards that all face the camera at several distances") {
    const auto result = estimated(stops_at(s, {{0, 0, .5}, {0, 0, .6}, {0, 0, .7}, {0, 0, .8}, {0, 0, .9}}, random));
    CHECK(names(result) == std::vector<std::string>{"translation along x", "translation along y", "rotation about z"});
    CHECK(result.untold[0].sigma_ratio == Approx(1).margin(0.1));
    CHECK(std::abs(result.moved[0]) < 0.001);
    CHECK(std::abs(result.moved[5]) < 0.001);
    CHECK(result.mount.covariance(0, 0) == Approx(kSigma_m * kSigma_m).epsilon(0.1));
    CHECK(result.belief.degrees_of_freedom == 4);
  }
  SECTION("boards that all tilt about one axis") {
    const auto result =
        estimated(stops_at(s, {{-.6, 0, .5}, {-.6, 0, .9}, {0, 0, .5}, {0, 0, .9}, {.6, 0, .5}, {.6, 0, .9}}, random));
    CHECK(names(result) == std::vector<std::string>{"translation along x"});
  }
  SECTION("one distance: the depth scale and the distance cannot be told apart well") {
    const auto result = estimated(
        stops_at(s, {{-.5, 0, .7}, {.5, 0, .7}, {0, -.5, .7}, {0, .5, .7}, {0, 0, .7}, {.4, .4, .7}}, random));
    const Vector7d error = error_of(s, result.mount), sigma = result.mount.covariance.diagonal().cwiseSqrt();
    CHECK(error.dot(result.mount.covariance.inverse() * error) < 24.3);  // 0.999 of 7
    CHECK(sigma[6] > 0.002);
  }
  SECTION("too few") {
    const auto refused = estimate_depth_to_color(stops_at(s, {{0, 0, .5}, {.4, 0, .6}}, random), factory());
    REQUIRE_FALSE(refused);
    CHECK(refused.error().fault == Fault::kTooFewViews);
    CHECK_THAT(std::string(refused.error().detail()), Contains("at 2 stops, 3 are needed"));
  }
}

TEST_CASE("a stop whose plane is another's is left out", "[calibration]") {
  Random random(25);
  const DepthSetup s;
  auto stops = observe_stops(s, 12, random);
  std::swap(stops[3].plane, stops[7].plane);
  const DepthToColor result = estimated(stops);
  CHECK_FALSE(result.stops[3].used);
  CHECK_FALSE(result.stops[7].used);
  CHECK(error_of(s, result.mount).head<3>().norm() < 0.004);
  for (std::size_t i = 0; i < 12; i += 2) std::swap(stops[i].plane, stops[i + 1].plane);
  const auto refused = estimate_depth_to_color(stops, factory());
  REQUIRE_FALSE(refused);
  CHECK_THAT(std::string(refused.error().detail()), Contains("contradict"));
}

TEST_CASE("stops that disagree more than their noise make the result less sure", "[calibration]") {
  constexpr int kTrials = test::trials(40);
  Random random(26);
  double nees = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const DepthSetup s = drawn(random);
    auto stops = observe_stops(s, 20, random);
    for (DepthStop& stop : stops) {  // a sensor whose errors are alike over the whole board
      const Vector6d common = (Vector6d() << 0.002 * random.normal3(), 0.005 * random.normal3()).finished();
      stop.camera_T_board = Transform<Camera, Board>(perturb(stop.camera_T_board.pose(), common));
    }
    const DepthToColor result = estimated(stops);
    CHECK(result.excess.offset_m == Approx(0.002).epsilon(0.6));
    CHECK(result.excess.tilt_rad == Approx(0.005).epsilon(0.6));
    const Vector7d error = error_of(s, result.mount);
    nees += error.dot(result.mount.covariance.inverse() * error) / kTrials;
  }
  CHECK(nees > 5);
  CHECK(nees < 9.5);  // 7, and a little more because 20 stops know their own scatter only roughly
}

TEST_CASE("numbers that are not finite are refused by name", "[calibration]") {
  Random random(27);
  const DepthSetup s;
  auto stops = observe_stops(s, 5, random);
  stops[2].plane.inverse_depth.x() = std::nan("");
  const auto refused = estimate_depth_to_color(stops, factory());
  REQUIRE_FALSE(refused);
  CHECK_THAT(std::string(refused.error().detail()), Contains("stop 3"));
  DepthMount certain = factory();
  certain.covariance.setZero();
  CHECK_FALSE(estimate_depth_to_color(observe_stops(s, 5, random), certain));
}
