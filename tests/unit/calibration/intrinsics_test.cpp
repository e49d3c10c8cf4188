#include "algorithms/calibration/intrinsics.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using test::Setup;

TEST_CASE("intrinsics come out of the views of the board", "[calibration]") {
  Setup setup;
  setup.board = {9, 6, 0.03};
  setup.distance_min_m = 0.4;
  setup.distance_max_m = 0.6;
  Random random(51);
  const auto views = test::observe_views(setup, 20, random);
  const auto estimate = estimate_intrinsics(640, 480, setup.board, views);
  REQUIRE(estimate);
  CHECK(estimate->camera.fx == Approx(setup.camera.fx).epsilon(0.005));
  CHECK(estimate->camera.fy == Approx(setup.camera.fy).epsilon(0.005));
  CHECK(estimate->camera.cx == Approx(setup.camera.cx).margin(2));
  CHECK(estimate->camera.cy == Approx(setup.camera.cy).margin(2));
  CHECK(estimate->reprojection_rms_px < 0.2);
}

TEST_CASE("views that cannot tell the intrinsics are refused", "[calibration]") {
  const Setup setup;
  Random random(52);
  auto views = test::observe_views(setup, 3, random);
  CHECK(estimate_intrinsics(640, 480, setup.board, views).error().fault == Fault::kTooFewViews);
  views = test::observe_views(setup, 5, random);
  views[1].corners_px.clear();
  CHECK(estimate_intrinsics(640, 480, setup.board, views).error().fault == Fault::kDataMalformed);
  std::vector<CalibrationView> nonsense(5,
                                        CalibrationView{{}, std::vector<Eigen::Vector2d>(48, Eigen::Vector2d(1, 1))});
  CHECK_FALSE(estimate_intrinsics(640, 480, setup.board, nonsense));
}

TEST_CASE("views that look straight at the board do not tell the focal length, and it is said", "[calibration]") {
  Setup setup;
  setup.tilt_max_rad = 0.1 * test::kDegree;
  Random random(53);
  const auto estimate = estimate_intrinsics(640, 480, setup.board, test::observe_views(setup, 12, random));
  REQUIRE_FALSE(estimate);
  CHECK(estimate.error().fault == Fault::kIntrinsicsUnknown);
  CHECK_THAT(std::string(estimate.error().detail()), Catch::Matchers::Contains("f"));
}
