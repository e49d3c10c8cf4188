#include "algorithms/calibration/bundle.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "platform/core/random.hpp"
#include "tests/oracle/calibration/ceres_bundle.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using namespace firstlook::test;

namespace {

Vector6d somewhere(Random& random) {
  Vector6d v;
  for (int i = 0; i < 6; ++i) v[i] = random.uniform(-1, 1);
  return v;
}

/// Views of `boards` boards side by side with noise, and a start that is off by centimetres and degrees.
struct Scene {
  Setup setup;
  std::vector<BoardSpec> boards;
  std::vector<std::vector<Eigen::Vector2d>> corners;
  std::vector<std::vector<double>> weights;
  std::vector<BundleView> views;
  BundleState start;
  BundleNoise noise;

  Scene(std::uint64_t seed, std::size_t board_count, int stations, double off) {
    Random random(seed);
    boards.assign(board_count, setup.board);
    corners.reserve(static_cast<std::size_t>(stations) * board_count);
    weights.reserve(corners.capacity());
    std::vector<Pose> base_T_board(board_count, setup.base_T_board);
    for (std::size_t b = 1; b < board_count; ++b) base_T_board[b].translation().y() += 0.12 * static_cast<double>(b);
    for (int s = 0; s < stations; ++s) {
      const Pose flange = flange_for(setup, random_camera_T_board(setup, random));
      const Pose said = perturb(flange, arm_noise(setup.arm_sigma, random));
      for (std::size_t b = 0; b < board_count; ++b) add_view(flange, said, base_T_board[b], b, s, random);
    }
    noise = {setup.corner_sigma_px, setup.arm_sigma};
    start.camera = setup.camera;
    start.flange_T_camera = perturb(setup.flange_T_camera, off * somewhere(random));
    for (const Pose& pose : base_T_board) start.base_T_board.push_back(perturb(pose, off * somewhere(random)));
    start.deviations.assign(static_cast<std::size_t>(stations), Vector6d::Zero());
  }

  void add_view(const Pose& flange, const Pose& said, const Pose& base_T_board, std::size_t board, int station,
                Random& random) {
    auto& seen = corners.emplace_back();
    auto& weight = weights.emplace_back();
    const Pose camera_T_board = (flange * setup.flange_T_camera).inverse(Eigen::Isometry) * base_T_board;
    for (int i = 0; i < setup.board.corners(); ++i) {
      const auto pixel = project(setup.camera, camera_T_board * setup.board.corner(i));
      REQUIRE(pixel);
      seen.emplace_back(*pixel + setup.corner_sigma_px * Eigen::Vector2d(random.normal(), random.normal()));
      weight.push_back(random.uniform(0.3, 1));
    }
    views.push_back({said, seen, weight, board, static_cast<std::size_t>(station)});
  }
};

/// With intrinsics the minimum is flat: both stop where the squares change by 1e-12 of themselves.
void check_same(const BundleState& a, const BundleState& b, double tolerance = 1e-8) {
  CHECK(pose_difference(a.flange_T_camera, b.flange_T_camera).norm() < tolerance);
  for (std::size_t k = 0; k < a.base_T_board.size(); ++k) {
    CHECK(pose_difference(a.base_T_board[k], b.base_T_board[k]).norm() < tolerance);
  }
  for (std::size_t s = 0; s < a.deviations.size(); ++s) CHECK((a.deviations[s] - b.deviations[s]).norm() < tolerance);
  CHECK((intrinsics_vector(a.camera) - intrinsics_vector(b.camera)).norm() < 1e-4);
}

}  // namespace

TEST_CASE("one board, several boards, intrinsics: the minimum is the one that Ceres finds") {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const std::size_t boards = 1 + seed % 3;
    const Scene scene(seed, boards, 6 + static_cast<int>(seed), 0.03);
    const auto estimated = seed % 2 == 0 ? EstimatedIntrinsics::kWithoutK3 : EstimatedIntrinsics::kNone;
    const IntrinsicsBelief belief = belief_of(estimated, std::nullopt);
    CAPTURE(seed, boards, belief.count);
    BundleState ours = scene.start, theirs = scene.start;
    if (belief.count > 0) ours.camera.fx = theirs.camera.fx = 1.01 * scene.setup.camera.fx;
    REQUIRE(solve_bundle(scene.boards, scene.views, scene.noise, belief, 60, ours));
    REQUIRE(solve_bundle_with_ceres(scene.boards, scene.views, scene.noise, belief, 60, theirs));
    check_same(ours, theirs, belief.count > 0 ? 2e-7 : 1e-8);
  }
}

TEST_CASE("a start that is off by a decimetre and ten degrees leads to the same minimum") {
  for (std::uint64_t seed = 21; seed <= 32; ++seed) {
    const Scene scene(seed, 1, 12, 0.1);
    CAPTURE(seed);
    BundleState ours = scene.start, theirs = scene.start;
    const IntrinsicsBelief known = belief_of(EstimatedIntrinsics::kNone, std::nullopt);
    REQUIRE(solve_bundle(scene.boards, scene.views, scene.noise, known, 60, ours));
    REQUIRE(solve_bundle_with_ceres(scene.boards, scene.views, scene.noise, known, 60, theirs));
    check_same(ours, theirs);
  }
}
