#include "algorithms/calibration/bundle.hpp"

#include <catch2/catch.hpp>

#include "tests/oracle/calibration/bundle_scene.hpp"
#include "tests/oracle/calibration/ceres_bundle.hpp"

using namespace firstlook;
using namespace firstlook::test;

namespace {

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
    const BundleScene scene(seed, boards, 6 + static_cast<int>(seed), 0.03);
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
    const BundleScene scene(seed, 1, 12, 0.1);
    CAPTURE(seed);
    BundleState ours = scene.start, theirs = scene.start;
    const IntrinsicsBelief known = belief_of(EstimatedIntrinsics::kNone, std::nullopt);
    REQUIRE(solve_bundle(scene.boards, scene.views, scene.noise, known, 60, ours));
    REQUIRE(solve_bundle_with_ceres(scene.boards, scene.views, scene.noise, known, 60, theirs));
    check_same(ours, theirs);
  }
}
