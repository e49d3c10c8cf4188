#include "algorithms/calibration/board_ambiguity.hpp"

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
    std::vector<OpenView> open;
    for (CalibrationView& view : views) {
      truth.push_back(!truth.empty() && random.uniform() < 0.5);
      if (truth.back()) std::reverse(view.corners_px.begin(), view.corners_px.end());
      const auto pose = estimate_board_pose(setup.camera, setup.board, view.corners_px);
      REQUIRE(pose);
      open.push_back(open_view(setup.board, view, *pose));
    }
    const auto choices = settle_choices(open);
    const auto known = settle_choices(open, Transform<Flange, Camera>(setup.flange_T_camera));
    for (std::size_t i = 0; i < open.size(); ++i) {
      CHECK(open[i].choices[choices[i]].reversed == truth[i]);
      CHECK(open[i].choices[known[i]].reversed == truth[i]);
    }
  }
}

TEST_CASE("the two poses of a single marker are settled over the views", "[calibration]") {
  Setup setup;
  setup.corner_sigma_px = 0.3;
  setup.board = {1, 1, .05, TargetType::kMarkerGrid, .05, MarkerDictionary::kAprilTag36h11};
  int first_wrong = 0, settled_wrong = 0, known_wrong = 0, views_in_all = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed, 72);
    const auto views = test::observe_views(setup, 15, random);
    std::vector<OpenView> open;
    std::vector<BoardPose> poses;
    for (const CalibrationView& view : views) {
      poses.push_back(estimate_board_pose(setup.camera, setup.board, view.corners_px).value());
      open.push_back(open_view(setup.board, view, poses.back()));
    }
    const auto choices = settle_choices(open);
    const auto known = settle_choices(open, Transform<Flange, Camera>(setup.flange_T_camera));
    for (std::size_t i = 0; i < open.size(); ++i) {
      const auto truth =
          (open[i].base_T_flange.pose() * setup.flange_T_camera).inverse(Eigen::Isometry) * setup.base_T_board;
      const auto off = [&](const Transform<Camera, Board>& t) {
        return rotation_log(t.rotation() * truth.linear().transpose()).norm();
      };
      double least = off(open[i].choices[0].camera_T_board);
      for (const PoseChoice& c : open[i].choices) least = std::min(least, off(c.camera_T_board));
      const auto is_wrong = [&](std::size_t c) { return off(open[i].choices[c].camera_T_board) > least ? 1 : 0; };
      first_wrong += is_wrong(0);
      settled_wrong += is_wrong(choices[i]);
      known_wrong += is_wrong(known[i]);
      ++views_in_all;
      adopt_choice(setup.board, open[i].choices[choices[i]], poses[i]);
      CHECK((poses[i].camera_T_board.rotation() - open[i].choices[choices[i]].camera_T_board.rotation()).norm() <
            1e-12);
    }
  }
  CAPTURE(first_wrong, settled_wrong, known_wrong, views_in_all);
  CHECK(first_wrong > 10);
  CHECK(settled_wrong <= 3);
  CHECK(known_wrong <= 3);
}
