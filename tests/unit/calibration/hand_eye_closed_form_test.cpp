#include "algorithms/calibration/hand_eye_closed_form.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "algorithms/calibration/view_gate.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using test::Setup;

namespace {

Pose random_pose(Random& random) {
  Pose pose = Pose::Identity();
  pose.linear() = random.rotation().toRotationMatrix();
  pose.translation() = 0.5 * random.normal3();
  return pose;
}

/// Noise-free pairs with flange rotations over the whole of SO(3).
std::vector<PosePair> exact_pairs(const Pose& flange_T_camera, const Pose& base_T_board, int count, Random& random) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < count; ++i) {
    const Pose flange = random_pose(random);
    const Pose board = (flange * flange_T_camera).inverse(Eigen::Isometry) * base_T_board;
    pairs.push_back({Transform<Base, Flange>(flange), Transform<Camera, Board>(board)});
  }
  return pairs;
}

void check_close(const Transform<Flange, Camera>& estimate, const Pose& truth, double limit) {
  const Vector6d error = pose_difference(truth, estimate.pose());
  CHECK(error.head<3>().norm() < limit);
  CHECK(error.tail<3>().norm() < limit);
}

}  // namespace

TEST_CASE("closed forms are exact without noise, for any hand-eye transform", "[calibration]") {
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Pose truth = random_pose(random);
    const auto pairs = exact_pairs(truth, random_pose(random), 5 + trial % 20, random);
    for (const Solver solver : {Solver::kParkMartin, Solver::kTsaiLenz}) {
      const auto solved = solve_closed_form(pairs, solver);
      REQUIRE(solved);
      check_close(*solved, truth, 1e-9);
    }
  }
}

TEST_CASE("hand-eye rotations of exactly 0 and 180 degrees", "[calibration]") {
  Random random(2);
  for (const Eigen::Vector3d& vector :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(std::numbers::pi, 0, 0), Eigen::Vector3d(0, std::numbers::pi, 0),
        Eigen::Vector3d(0, 0, std::numbers::pi),
        Eigen::Vector3d(Eigen::Vector3d(1, 1, 0).normalized() * std::numbers::pi)}) {
    Pose truth = Pose::Identity();
    truth.linear() = rotation_exp(vector);
    truth.translation() = Eigen::Vector3d(.1, .2, .3);
    const auto pairs = exact_pairs(truth, random_pose(random), 8, random);
    for (const Solver solver : {Solver::kParkMartin, Solver::kTsaiLenz}) {
      const auto solved = solve_closed_form(pairs, solver);
      REQUIRE(solved);
      check_close(*solved, truth, 1e-9);
    }
  }
}

TEST_CASE("the order of the views does not matter", "[calibration]") {
  Random random(3);
  const Setup setup;
  auto pairs = test::observe_pairs(setup, 12, random);
  const auto forward = solve_closed_form(pairs);
  std::reverse(pairs.begin(), pairs.end());
  std::swap(pairs[2], pairs[7]);
  const auto other = solve_closed_form(pairs);
  REQUIRE(forward);
  REQUIRE(other);
  check_close(*other, forward->pose(), 1e-12);
}

TEST_CASE("three or four views with modest rotations give a rough answer", "[calibration]") {
  Setup setup;
  setup.tilt_max_rad = 15 * test::kDegree;
  setup.roll_max_rad = 15 * test::kDegree;
  Random random(4);
  int close = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const auto pairs = test::observe_pairs(setup, 3 + trial % 2, random);
    const auto solved = solve_closed_form(pairs);
    if (!solved) continue;
    const Vector6d error = pose_difference(setup.flange_T_camera, solved->pose());
    if (error.head<3>().norm() < 0.02 && error.tail<3>().norm() < 0.02) ++close;
  }
  CHECK(close >= 90);
}

TEST_CASE("motions that cannot tell are named", "[calibration]") {
  Random random(5);
  const Setup setup;
  std::vector<PosePair> one_axis, no_rotation;
  for (int i = 0; i < 10; ++i) {
    Pose flange = Pose::Identity();
    flange.linear() = rotation_exp({0, 0, 0.2 * i});
    flange.translation() = random.normal3();
    Pose board = (flange * setup.flange_T_camera).inverse(Eigen::Isometry) * setup.base_T_board;
    one_axis.push_back({Transform<Base, Flange>(flange), Transform<Camera, Board>(board)});
    flange.linear().setIdentity();
    board = (flange * setup.flange_T_camera).inverse(Eigen::Isometry) * setup.base_T_board;
    no_rotation.push_back({Transform<Base, Flange>(flange), Transform<Camera, Board>(board)});
  }
  for (const Solver solver : {Solver::kParkMartin, Solver::kTsaiLenz}) {
    const auto one = solve_closed_form(one_axis, solver);
    REQUIRE_FALSE(one);
    CHECK(one.error().fault == Fault::kDegenerateMotion);
    CHECK(one.error().detail().find("one axis") != std::string_view::npos);
    CHECK(solve_closed_form(no_rotation, solver).error().fault == Fault::kDegenerateMotion);
    CHECK(solve_closed_form(std::span(one_axis).first(2), solver).error().fault == Fault::kTooFewViews);
    CHECK(solve_closed_form({}, solver).error().fault == Fault::kTooFewViews);
  }
  CHECK(motion_diversity(one_axis).axes == 1);
  CHECK(motion_diversity(one_axis).angle_max_rad == Approx(1.8));
  CHECK(motion_diversity(no_rotation).axes == 0);
  const std::vector<PosePair> same(8, one_axis[3]);
  CHECK(solve_closed_form(same).error().fault == Fault::kDegenerateMotion);
}

TEST_CASE("a pose that is not finite is refused", "[calibration]") {
  Random random(6);
  auto pairs = test::observe_pairs(Setup{}, 6, random);
  Pose broken = pairs[2].base_T_flange.pose();
  broken.translation().x() = std::nan("");
  pairs[2].base_T_flange = Transform<Base, Flange>(broken);
  CHECK(solve_closed_form(pairs).error().fault == Fault::kSolveFailed);
}

TEST_CASE("solvers by name", "[calibration]") {
  CHECK(find_solver("park-martin") == Solver::kParkMartin);
  CHECK(find_solver("tsai-lenz") == Solver::kTsaiLenz);
  CHECK_FALSE(find_solver("tsai"));
  CHECK_FALSE(find_solver(""));
}

TEST_CASE("residual of AX = XB", "[calibration]") {
  Random random(7);
  Setup setup;
  setup.arm_sigma = {0, 0};
  const auto pairs = test::observe_pairs(setup, 6, random);
  const Transform<Flange, Camera> truth(setup.flange_T_camera);
  CHECK(ax_xb_residual_all_pairs(pairs, truth).rotation_rms_deg < 1e-6);
  CHECK(ax_xb_residual_all_pairs(pairs, truth).translation_rms_mm < 1e-6);
  CHECK(board_in_base_residual(pairs, truth).rotation_rms_deg < 1e-6);
  CHECK(board_in_base_residual(pairs, truth).translation_rms_mm < 1e-6);
  // A wrong translation t shows as (R_A - I) t between two views.
  Vector6d shift = Vector6d::Zero();
  shift.x() = 0.01;
  const Transform<Flange, Camera> off(perturb(setup.flange_T_camera, shift));
  const Eigen::Matrix3d turn = pairs[0].base_T_flange.rotation().transpose() * pairs[1].base_T_flange.rotation();
  const auto residual = ax_xb_residual_consecutive(std::span(pairs).first(2), off);
  CHECK(residual.translation_rms_mm == Approx(((turn - Eigen::Matrix3d::Identity()) * shift.head<3>()).norm() * 1e3));
}

TEST_CASE("wrong views do not spoil the robust start", "[calibration]") {
  const Setup setup;
  int close = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    auto pairs = test::observe_pairs(setup, 20, random);
    for (const std::size_t wrong : {3U, 8U, 9U, 15U})
      std::swap(pairs[wrong].base_T_flange, pairs[wrong + 1].base_T_flange);
    const auto solved = robust_closed_form(pairs, Solver::kParkMartin, 6);
    REQUIRE(solved);
    const Vector6d error = pose_difference(setup.flange_T_camera, solved->pose());
    if (error.head<3>().norm() < 2e-3 && error.tail<3>().norm() < 3e-3) ++close;
  }
  CHECK(close >= 19);
}
