#include "algorithms/calibration/camera_on_arm.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using test::Setup;

namespace {
BoardPose see(const Setup& setup, const Pose& base_T_flange, Random& random) {
  const auto view = test::observe(setup, base_T_flange, random);
  return *estimate_board_pose(setup.camera, setup.board, view.corners_px);
}
}  // namespace

TEST_CASE("noise is no change, a turned wrist is, a swung arm is", "[calibration]") {
  const Setup setup;
  Random random(41);
  for (int trial = 0; trial < 50; ++trial) {
    const Pose flange = test::flange_for(setup, test::random_camera_T_board(setup, random));
    const BoardPose before = see(setup, flange, random);
    CHECK_FALSE(compare_views(setup.camera, setup.board, before, see(setup, flange, random)).changed);
    Pose turned = flange;
    turned.linear() = flange.linear() * rotation_exp({0, 0, 5 * test::kDegree});
    const ViewChange wrist = compare_views(setup.camera, setup.board, before, see(setup, turned, random));
    CHECK(wrist.changed);
    CHECK(wrist.rotation_rad == Approx(5 * test::kDegree).margin(0.02));
    Pose swung = Pose::Identity();
    swung.linear() = rotation_exp({0, 0, 3 * test::kDegree});
    CHECK(compare_views(setup.camera, setup.board, before, see(setup, swung * flange, random)).changed);
  }
}
