#include "algorithms/calibration/intrinsics_misfit.hpp"

#include <catch2/catch.hpp>

#include "algorithms/calibration/verdict.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using test::Setup;

namespace {

CameraIntrinsics wrong_camera(CameraIntrinsics camera) {
  camera.fx *= 1.002;
  camera.fy *= 1.002;
  camera.cx += 1;
  camera.cy += 1;
  return camera;
}

std::string misfit(const CameraIntrinsics& given, const Setup& setup, const std::vector<CalibrationView>& views) {
  const auto solved = solve_hand_eye(given, setup.board, views);
  REQUIRE(solved);
  return intrinsics_misfit(given, setup.board, views, {}, {solved->flange_T_camera, solved->covariance});
}

}  // namespace

TEST_CASE("right intrinsics fit, wrong ones do not", "[calibration]") {
  const Setup setup;
  int turned_down = 0, found = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed, 31);
    const auto views = test::observe_views(setup, 15, random);
    turned_down += misfit(setup.camera, setup, views).empty() ? 0 : 1;
    found += misfit(wrong_camera(setup.camera), setup, views).empty() ? 0 : 1;
  }
  CHECK(turned_down == 0);
  CHECK(found >= 18);
}

TEST_CASE("few views say nothing against intrinsics", "[calibration]") {
  const Setup setup;
  Random random(33);
  const auto views = test::observe_views(setup, 7, random);
  CHECK(misfit(wrong_camera(setup.camera), setup, views).empty());
}

TEST_CASE("a calibration with wrong intrinsics is rejected for them", "[calibration][slow]") {
  Setup setup;
  setup.distance_min_m = 0.35;  // near enough to be accepted
  setup.distance_max_m = 0.5;
  Random random(34);
  const auto views = test::observe_views(setup, 25, random);
  const auto right = calibrate_hand_eye(setup.camera, setup.board, views);
  REQUIRE(right);
  CHECK(right->verdict == Verdict::kAccepted);
  const CameraIntrinsics given = wrong_camera(setup.camera);
  const auto wrong = calibrate_hand_eye(given, setup.board, views);
  REQUIRE(wrong);
  CHECK(wrong->verdict == Verdict::kRejected);
  REQUIRE(wrong->likely_mistake);
  CHECK(wrong->likely_mistake->mistake == Mistake::kIntrinsics);
  CHECK_THAT(wrong->reasons.back(), Catch::Matchers::Contains("do not fit these views"));

  HandEyeOptions options;
  options.refinement.intrinsics = EstimatedIntrinsics::kWithoutK3;
  const auto mended = calibrate_hand_eye(given, setup.board, views, options);
  REQUIRE(mended);
  CHECK(mended->verdict == Verdict::kAccepted);
  CHECK(mended->camera.fx == Approx(setup.camera.fx).margin(5 * mended->intrinsics->sigma()[0]));
  const Vector6d error = pose_difference(setup.flange_T_camera, mended->flange_T_camera.pose());
  CHECK(error.head<3>().norm() < 1e-3);
  CHECK(mended->holdout_rms_px < wrong->holdout_rms_px);
}
