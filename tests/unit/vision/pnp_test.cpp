#include "algorithms/vision/pnp.hpp"

#include <catch2/catch.hpp>

#include "algorithms/vision/detector_presets.hpp"
#include "tests/unit/vision/draw_board.hpp"

using namespace firstlook;
using test::look_at_board;

namespace {
constexpr CameraIntrinsics kCamera{640, 480, 534.78, 534.10, 308.63, 226.92, .04586, -.1301, .0025, -.0006, 0};

std::vector<Eigen::Vector2d> seen(const BoardSpec& board, const Pose& pose, double sigma_px, Random& random) {
  std::vector<Eigen::Vector2d> px;
  for (int i = 0; i < board.corners(); ++i) {
    px.push_back(*project(kCamera, pose * board.corner(i)) +
                 sigma_px * Eigen::Vector2d(random.normal(), random.normal()));
  }
  return px;
}
}  // namespace

TEST_CASE("every solver finds the pose, with and without sampling", "[vision][pnp]") {
  const BoardSpec board{9, 6, 0.03};
  Random random(5);
  for (const PnpMethod method : {PnpMethod::kIterative, PnpMethod::kP3p, PnpMethod::kEpnp, PnpMethod::kIppe}) {
    for (const bool ransac : {false, true}) {
      for (int trial = 0; trial < 20; ++trial) {
        const Pose pose =
            look_at_board(board, 0.6, random.uniform(0.2, 0.7), random.uniform(0, 6), random.uniform(0, 6));
        const auto exact = seen(board, pose, 0, random);
        PnpOptions options{method, std::nullopt};
        if (ransac) options.ransac = RansacOptions{};
        const auto solved = solve_pnp(kCamera, board, exact, options);
        CAPTURE(pnp_method_name(method), ransac, trial);
        REQUIRE(solved);
        const auto& best = solved->solutions.front();
        CHECK((best.camera_T_board.translation() - pose.translation()).norm() < 1e-4);
        CHECK(best.residual_rms_px < 0.05);
        CHECK(solved->inliers.size() == 54);
        if (method == PnpMethod::kIppe) CHECK(solved->solutions.size() == 2);
      }
    }
  }
}

TEST_CASE("sampling leaves wrong points out, and says when too few agree", "[vision][pnp]") {
  const BoardSpec board{9, 6, 0.03};
  Random random(6);
  const Pose pose = look_at_board(board, 0.6, 0.4, 1, 2);
  auto points = seen(board, pose, 0.1, random);
  for (std::size_t i = 0; i < 12; ++i) points[4 * i] += Eigen::Vector2d(40, -30);
  const auto preset = find_detector_preset("thesis2014");
  REQUIRE(preset);
  const auto solved = solve_pnp(kCamera, board, points, preset->pnp);
  REQUIRE(solved);
  CHECK(solved->inliers.size() == 42);
  CHECK((solved->solutions.front().camera_T_board.translation() - pose.translation()).norm() < 0.002);
  for (auto& p : points) p = {random.uniform(0, 640), random.uniform(0, 480)};
  CHECK_FALSE(solve_pnp(kCamera, board, points, preset->pnp));
  points.pop_back();
  CHECK_FALSE(solve_pnp(kCamera, board, points));
}

TEST_CASE("names of solvers and presets", "[vision][pnp]") {
  CHECK(find_pnp_method("epnp") == PnpMethod::kEpnp);
  CHECK_FALSE(find_pnp_method("magic"));
  REQUIRE(find_detector_preset("thesis2014_detector2"));
  CHECK(find_detector_preset("thesis2014_detector2")->detection.fixed_half_window_px == 5);
  CHECK(detector_presets().size() == detector_preset_names().size());
  for (const auto name : detector_preset_names()) CHECK(find_detector_preset(name)->name == name);
}
