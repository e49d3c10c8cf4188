#include "algorithms/calibration/hand_eye_refinement.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <numeric>

#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/calibration/reprojection_terms.hpp"
#include "algorithms/calibration/view_gate.hpp"
#include "algorithms/vision/board_pose.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using test::Setup;

namespace {

Transform<Flange, Camera> closed_form(const Setup& setup, const std::vector<CalibrationView>& views) {
  std::vector<PosePair> pairs;
  for (const CalibrationView& view : views) {
    pairs.push_back({view.base_T_flange,
                     estimate_board_pose_robust(setup.camera, setup.board, view.corners_px)->pose.camera_T_board});
  }
  return *robust_closed_form(pairs, Solver::kParkMartin, 6);
}

/// Mean squares over seeds: of the error, of the bound, and the normalised error squared.
struct Trials {
  double translation2 = 0, rotation2 = 0;
  double bound_translation2 = 0, bound_rotation2 = 0;
  double normalized = 0;
  double log_arm_translation = 0, log_arm_rotation = 0;  ///< mean log of estimated over true sigma
  /// Mean square of estimated over true sigma. Where the camera is weaker than the arm some seeds see no arm error at
  /// all: their sigma is the lower bound and its log large, but the variance is right on average.
  double arm_translation2 = 0, arm_rotation2 = 0;
  [[nodiscard]] double translation_ratio() const { return std::sqrt(translation2 / bound_translation2); }
  [[nodiscard]] double rotation_ratio() const { return std::sqrt(rotation2 / bound_rotation2); }
};

/// Covariance that no unbiased estimator can beat when all sigmas are known.
Matrix6d cramer_rao_bound(const Setup& setup, const std::vector<CalibrationView>& views) {
  Matrix12d information = prior_information();
  for (const CalibrationView& view : views) information += view_information(setup.model(), view.base_T_flange);
  return predicted_covariance(information);
}

Trials run_trials(const Setup& setup, int views_each, int seeds, const RefinementOptions& options = {}) {
  Trials t;
  const double n = seeds;
  for (int seed = 1; seed <= seeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), 9);
    const auto views = test::observe_views(setup, views_each, random);
    const auto fit = refine_hand_eye(setup.camera, setup.board, views, closed_form(setup, views), options);
    REQUIRE(fit);
    const Vector6d error = pose_difference(setup.flange_T_camera, fit->flange_T_camera.pose());
    const Matrix6d bound = cramer_rao_bound(setup, views);
    t.translation2 += error.head<3>().squaredNorm() / n;
    t.rotation2 += error.tail<3>().squaredNorm() / n;
    t.bound_translation2 += bound.topLeftCorner<3, 3>().trace() / n;
    t.bound_rotation2 += bound.bottomRightCorner<3, 3>().trace() / n;
    t.normalized += error.dot(fit->covariance.inverse() * error) / n;
    t.log_arm_translation += std::log(fit->arm_sigma.translation_m / setup.arm_sigma.translation_m) / n;
    t.log_arm_rotation += std::log(fit->arm_sigma.rotation_rad / setup.arm_sigma.rotation_rad) / n;
    t.arm_translation2 += std::pow(fit->arm_sigma.translation_m / setup.arm_sigma.translation_m, 2) / n;
    t.arm_rotation2 += std::pow(fit->arm_sigma.rotation_rad / setup.arm_sigma.rotation_rad, 2) / n;
  }
  UNSCOPED_INFO("RMS " << std::sqrt(t.translation2) * 1e3 << " mm " << std::sqrt(t.rotation2) * 1e3
                       << " mrad, over the bound " << t.translation_ratio() << " / " << t.rotation_ratio()
                       << ", normalised " << t.normalized << ", arm " << t.log_arm_translation << " "
                       << t.log_arm_rotation << " squares " << t.arm_translation2 << " " << t.arm_rotation2);
  return t;
}

}  // namespace

TEST_CASE("derivatives of a corner agree with differences", "[calibration]") {
  const Setup setup;
  Random random(2);
  const Pose flange = test::flange_for(setup, test::random_camera_T_board(setup, random));
  const ViewGeometry at{setup.flange_T_camera, setup.base_T_board, flange};
  const Eigen::Vector3d corner = setup.board.corner(13);
  const auto term = corner_term(setup.camera, at, corner);
  REQUIRE(term);
  constexpr double kStep = 1e-6;
  for (int axis = 0; axis < 6; ++axis) {
    const Vector6d step = kStep * Vector6d::Unit(axis);
    const auto slope = [&](auto change) -> Eigen::Vector2d {
      ViewGeometry up = at, down = at;
      change(up, step);
      change(down, Vector6d(-step));
      return (corner_term(setup.camera, up, corner)->pixel - corner_term(setup.camera, down, corner)->pixel) /
             (2 * kStep);
    };
    using Step = const Vector6d&;
    const auto x = slope([](ViewGeometry& g, Step s) { g.flange_T_camera = perturb(g.flange_T_camera, s); });
    const auto w = slope([](ViewGeometry& g, Step s) { g.base_T_board = perturb(g.base_T_board, s); });
    const auto f = slope([](ViewGeometry& g, Step s) { g.base_T_flange = perturb(g.base_T_flange, s); });
    CHECK((x - term->d_hand_eye.col(axis)).norm() < 1e-4);
    CHECK((w - term->d_board.col(axis)).norm() < 1e-4);
    CHECK((f - term->d_arm.col(axis)).norm() < 1e-4);
  }
}

TEST_CASE("without noise the refinement is exact", "[calibration]") {
  Setup setup;
  setup.corner_sigma_px = 0;
  setup.arm_sigma = {0, 0};
  Random random(3);
  const auto views = test::observe_views(setup, 10, random);
  Vector6d off;
  off << 0.01, -0.02, 0.015, 0.05, 0.03, -0.04;
  const Transform<Flange, Camera> start(perturb(setup.flange_T_camera, off));
  const auto fit = refine_hand_eye(setup.camera, setup.board, views, start);
  REQUIRE(fit);
  CHECK(pose_difference(setup.flange_T_camera, fit->flange_T_camera.pose()).norm() < 1e-8);
  CHECK(pose_difference(setup.base_T_board, fit->base_T_board.pose()).norm() < 1e-8);
  CHECK(fit->reprojection_rms_px < 1e-6);
}

TEST_CASE("errors reach the bound and the covariance is honest, sigmas estimated", "[calibration][slow]") {
  const Trials t = run_trials(Setup{}, 25, test::trials(120));
  const double wider = test::margin_factor();
  CHECK(t.translation_ratio() < 1 + 0.12 * wider);
  CHECK(t.rotation_ratio() < 1 + 0.12 * wider);
  CHECK(t.normalized > 6 - 1.5 * wider);
  CHECK(t.normalized < 6 + 2 * wider);
  CHECK(t.arm_translation2 == Approx(1).margin(0.3 * wider));
  CHECK(t.arm_rotation2 == Approx(1).margin(0.3 * wider));
}

TEST_CASE("the same with a poor arm, and with few views", "[calibration][slow]") {
  Setup poor;
  poor.arm_sigma = {5e-4, 1e-3};
  const double wider = test::margin_factor();
  const Trials t = run_trials(poor, 25, test::trials(60));
  CHECK(t.translation_ratio() < 1 + 0.2 * wider);
  CHECK(t.rotation_ratio() < 1 + 0.2 * wider);
  CHECK(t.normalized > 6 - 1.8 * wider);
  CHECK(t.normalized < 6 + 2.5 * wider);
  const Trials few = run_trials(poor, 10, test::trials(60));
  CHECK(few.normalized < 6 + 5 * wider);  // ten views cannot tell the sigmas sharply
  CHECK(few.translation_ratio() < 1 + 0.35 * wider);
}

TEST_CASE("wrong corners and wrong poses are found and do no harm", "[calibration]") {
  const Setup setup;
  int gated_right = 0;
  double normalized = 0;
  constexpr std::uint64_t kSeeds = 15;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    Random random(seed, 10);
    auto views = test::observe_views(setup, 22, random);
    views[4].corners_px[17] += Eigen::Vector2d(9, -7);
    views[11].corners_px[3] += Eigen::Vector2d(-4, 5);
    std::swap(views[6].base_T_flange, views[7].base_T_flange);  // stale poses
    const auto fit = refine_hand_eye(setup.camera, setup.board, views, closed_form(setup, views));
    REQUIRE(fit);
    gated_right += !fit->views[6].used && !fit->views[7].used && fit->views_used == 20 ? 1 : 0;
    const Vector6d error = pose_difference(setup.flange_T_camera, fit->flange_T_camera.pose());
    normalized += error.dot(fit->covariance.inverse() * error) / static_cast<double>(kSeeds);
  }
  CHECK(gated_right >= 14);
  CHECK(normalized < 11);
}

TEST_CASE("pose pairs alone: exact without noise, honest with it", "[calibration]") {
  Setup setup;
  setup.arm_sigma = {4e-4, 8e-4};
  double normalized = 0, log_translation = 0, log_rotation = 0;
  constexpr std::uint64_t kSeeds = 200;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    Random random(seed, 11);
    const auto pairs = test::observe_pairs(setup, 25, random);
    const auto fit = refine_from_pairs(pairs, *solve_closed_form(pairs));
    REQUIRE(fit);
    const Vector6d error = pose_difference(setup.flange_T_camera, fit->flange_T_camera.pose());
    normalized += error.dot(fit->covariance.inverse() * error) / static_cast<double>(kSeeds);
    log_translation += std::log(fit->arm_sigma.translation_m / 4e-4) / static_cast<double>(kSeeds);
    log_rotation += std::log(fit->arm_sigma.rotation_rad / 8e-4) / static_cast<double>(kSeeds);
  }
  CHECK(normalized > 4.8);
  CHECK(normalized < 8);
  CHECK(std::abs(log_translation) < 0.1);
  CHECK(std::abs(log_rotation) < 0.1);

  setup.arm_sigma = {0, 0};
  Random random(5);
  const auto pairs = test::observe_pairs(setup, 8, random);
  Vector6d off;
  off << 0.01, -0.02, 0.015, 0.05, 0.03, -0.04;
  const auto fit = refine_from_pairs(pairs, Transform<Flange, Camera>(perturb(setup.flange_T_camera, off)));
  REQUIRE(fit);
  CHECK(pose_difference(setup.flange_T_camera, fit->flange_T_camera.pose()).norm() < 1e-9);
}

TEST_CASE("hostile input is refused", "[calibration]") {
  const Setup setup;
  Random random(6);
  const auto views = test::observe_views(setup, 6, random);
  const Transform<Flange, Camera> start(setup.flange_T_camera);
  const auto fault_of = [&](const std::vector<CalibrationView>& v) {
    const auto fit = refine_hand_eye(setup.camera, setup.board, v, start);
    return fit ? Fault::kInternal : fit.error().fault;
  };
  CHECK(fault_of({}) == Fault::kTooFewViews);
  CHECK(fault_of({views[0], views[1]}) == Fault::kTooFewViews);
  CHECK(fault_of({views[0], views[0], views[0], views[0]}) == Fault::kDegenerateMotion);
  auto broken = views;
  broken[2].corners_px.pop_back();
  CHECK(fault_of(broken) == Fault::kDataMalformed);
  broken = views;
  Pose pose = broken[1].base_T_flange.pose();
  pose.translation().y() = std::numeric_limits<double>::infinity();
  broken[1].base_T_flange = Transform<Base, Flange>(pose);
  CHECK(fault_of(broken) == Fault::kDataMalformed);
  broken = views;
  broken[3].corners_px[5].x() = std::nan("");
  const auto one_out = refine_hand_eye(setup.camera, setup.board, broken, start);
  REQUIRE(one_out);
  CHECK_FALSE(one_out->views[3].used);
  CHECK(one_out->views_used == 5);
  CameraIntrinsics bad = setup.camera;
  bad.fx = 0;
  CHECK(refine_hand_eye(bad, setup.board, views, start).error().fault == Fault::kDataMalformed);
}

TEST_CASE("what is expected of the arm holds up a sigma that few views tell badly", "[calibration]") {
  const Setup setup;  // a good arm
  RefinementOptions expecting;
  expecting.arm_sigma_expected = setup.arm_sigma;
  const Trials alone = run_trials(setup, 8, 40);
  const Trials held = run_trials(setup, 8, 40, expecting);
  CHECK(held.log_arm_translation > alone.log_arm_translation + 0.1);
  CHECK(std::abs(held.log_arm_translation) < 0.25);
  CHECK(held.normalized < alone.normalized);
  CHECK(held.normalized > 3.5);
  // An arm that is worse than expected is found out all the same.
  Setup poor;
  poor.arm_sigma = {5 * setup.arm_sigma.translation_m, 5 * setup.arm_sigma.rotation_rad};
  CHECK(run_trials(poor, 20, 20, expecting).log_arm_translation > -0.2);
}
