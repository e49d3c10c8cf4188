#include "algorithms/calibration/board_flips.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "algorithms/vision/board_pose.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using test::Setup;

TEST_CASE("views with the board upside down are told from the arm's motion", "[calibration]") {
  Setup setup;
  setup.roll_max_rad = 170 * test::kDegree;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Random random(seed, 71);
    auto views = test::observe_views(setup, 10, random);
    std::vector<bool> truth;
    std::vector<PosePair> pairs;
    for (CalibrationView& view : views) {
      truth.push_back(!truth.empty() && random.uniform() < 0.5);
      if (truth.back()) std::reverse(view.corners_px.begin(), view.corners_px.end());
      const auto pose = estimate_board_pose(setup.camera, setup.board, view.corners_px);
      REQUIRE(pose);
      pairs.push_back({view.base_T_flange, pose->camera_T_board});
    }
    CHECK(settle_board_flips(setup.board, pairs) == truth);
  }
}
