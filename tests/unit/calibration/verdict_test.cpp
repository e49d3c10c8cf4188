#include "algorithms/calibration/verdict.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using test::Setup;

TEST_CASE("usable distance: the thesis's figures give its 0.69 m", "[calibration]") {
  CHECK(usable_distance_of_errors({2.857e-3, -1.022e-3, -0.286e-3}, -6.966e-3, 4.685e-3, 0.01) ==
        Approx(0.6949).epsilon(0.01));
  CHECK(usable_distance_of_errors({0.006, 0.003, 0.002}, 0.001, 0.001, 0.01) == 0);
  CHECK(usable_distance_of_errors({0, 0, 0}, 0, 0, 0.01) == 100);
}

TEST_CASE("usable distance leaves the roll about the optical axis out", "[calibration]") {
  const Setup setup;
  const Transform<Flange, Camera> hand_eye(setup.flange_T_camera);
  const Eigen::Vector3d axis = hand_eye.rotation().col(2);
  Matrix6d roll_only = Matrix6d::Zero();
  roll_only.bottomRightCorner<3, 3>() = 1e-4 * axis * axis.transpose();
  CHECK(usable_distance(hand_eye, roll_only, 0.01) == 100);
  Matrix6d all = roll_only;
  all.bottomRightCorner<3, 3>() = 1e-6 * Eigen::Matrix3d::Identity();
  CHECK(usable_distance(hand_eye, all, 0.01) == Approx(0.01 / (3e-3 * std::sqrt(2.0))).epsilon(1e-4));
  CHECK(point_sigma(hand_eye, all, 1.5) == Approx(1.5e-3));
}

TEST_CASE("a good set is accepted, with figures that belong together", "[calibration]") {
  const Setup setup;
  Random random(21);
  const auto views = test::observe_views(setup, 25, random);
  const auto result = calibrate_hand_eye(setup.camera, setup.board, views);
  REQUIRE(result);
  for (const std::string& reason : result->reasons) UNSCOPED_INFO(reason);
  CHECK(result->verdict == Verdict::kAccepted);
  CHECK(result->views == 25);
  CHECK(pose_difference(setup.flange_T_camera, result->flange_T_camera.pose()).head<3>().norm() < 1e-3);
  CHECK(result->sigma_translation_m.x() == Approx(std::sqrt(result->covariance(0, 0))));
  CHECK(result->reprojection_rms_px == Approx(0.1).epsilon(0.15));
  CHECK(result->holdout_rms_px > result->reprojection_rms_px);
  CHECK(result->holdout_rms_px < 0.6);
  CHECK(result->holdout_rms_m < 1e-3);
  CHECK(result->subset_spread_m > 0);
  CHECK(result->subset_spread_m < 5e-4);
  CHECK(result->usable_distance_m > 1);
  CHECK(result->fits.size() == 25);

  // The figure of the whole is that of the views, each held out once.
  REQUIRE(result->holdout_px.size() == 25);
  double squared_px = 0;
  for (const std::optional<double>& view_px : result->holdout_px) {
    REQUIRE(view_px);
    squared_px += *view_px * *view_px;
  }
  CHECK(result->holdout_rms_px == Approx(std::sqrt(squared_px / 25)));

  const auto again = calibrate_hand_eye(setup.camera, setup.board, views);
  CHECK(again->flange_T_camera.pose().matrix() == result->flange_T_camera.pose().matrix());
  CHECK(again->covariance == result->covariance);
  CHECK(again->subset_spread_m == result->subset_spread_m);
}

TEST_CASE("poor sets are rejected with reasons", "[calibration]") {
  Setup poor;
  poor.arm_sigma = {4e-3, 8e-3};
  Random random(22);
  const auto views = test::observe_views(poor, 10, random);
  const auto result = calibrate_hand_eye(poor.camera, poor.board, views);
  REQUIRE(result);
  CHECK(result->verdict == Verdict::kRejected);
  CHECK(result->reasons.size() >= 3);
  CHECK(result->arm_sigma.translation_m > 1e-3);
  // The error must lie inside what the sigmas say.
  const Vector6d error = pose_difference(poor.flange_T_camera, result->flange_T_camera.pose());
  CHECK(error.head<3>().norm() < 4 * result->sigma_translation_m.norm());

  const Setup good;
  const auto few = test::observe_views(good, 4, random);
  const auto rough = calibrate_hand_eye(good.camera, good.board, few);
  REQUIRE(rough);
  CHECK(rough->verdict == Verdict::kRejected);
}

TEST_CASE("a view that the solve left out is not held out, either, and the others keep their places", "[calibration]") {
  const Setup setup;
  Random random(29);
  auto views = test::observe_views(setup, 20, random);
  views[6].base_T_flange = views[11].base_T_flange;  // a pose of another view
  const auto result = calibrate_hand_eye(setup.camera, setup.board, views);
  REQUIRE(result);
  REQUIRE(result->holdout_px.size() == 20);
  for (std::size_t i = 0; i < views.size(); ++i) {
    CHECK(result->fits[i].used == (i != 6));
    CHECK(result->holdout_px[i].has_value() == (i != 6));
  }
  HandEyeOptions options;
  auto solved = solve_hand_eye(setup.camera, setup.board, views, options);
  REQUIRE(solved);
  CHECK(solved->holdout_px.empty());
  CHECK(solved->verdict == Verdict::kRejected);
  CHECK(solved->reasons == std::vector<std::string>{"not validated"});
  // Held out by hand: the group that view 11 is in (the tenth of those used) against the others.
  std::vector<CalibrationView> others;
  std::size_t place = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (i == 6) continue;
    if (place++ % 5 != 10 % 5) others.push_back(views[i]);
  }
  const auto without = solve_hand_eye(setup.camera, setup.board, others, options);
  REQUIRE(without);
  const double by_hand_px = reprojection_rms(setup.camera, setup.board, std::span(&views[11], 1),
                                             without->flange_T_camera, without->base_T_board);
  CHECK(*result->holdout_px[11] == Approx(by_hand_px).epsilon(0.3));
}

TEST_CASE("a board that moves before the last views, or after the first, is no calibration, however few they are",
          "[calibration]") {
  Setup moved;
  moved.base_T_board.translation() += Eigen::Vector3d(0.02, -0.01, 0.01);
  for (const std::size_t views_after : {1, 2, 3}) {
    for (const bool at_the_end : {true, false}) {
      const Setup setup;
      Random random(40 + views_after);
      auto views = test::observe_views(setup, 16 - static_cast<int>(views_after), random);
      const auto others = test::observe_views(moved, static_cast<int>(views_after), random);
      views.insert(at_the_end ? views.end() : views.begin(), others.begin(), others.end());
      INFO(views_after << (at_the_end ? " last" : " first"));
      for (const int allowed : {0, 1}) {
        HandEyeOptions options;
        (at_the_end ? options.limits.gated_last_max : options.limits.gated_first_max) = allowed;
        const auto result = calibrate_hand_eye(setup.camera, setup.board, views, options);
        REQUIRE(result);
        const bool accepts = views_after <= static_cast<std::size_t>(allowed);
        CHECK((result->verdict == Verdict::kAccepted) == accepts);
        CHECK(result->only_last_contradicts == (at_the_end && views_after == 1 && allowed == 0));
        if (!accepts) {
          REQUIRE_FALSE(result->reasons.empty());
          CHECK_THAT(result->reasons[0], Catch::Contains(at_the_end ? "last" : "first") && Catch::Contains("moved"));
        }
      }
    }
  }
  // Wrong views in between are left out, as before.
  const Setup setup;
  Random random(47);
  auto views = test::observe_views(setup, 16, random);
  const auto others = test::observe_views(moved, 2, random);
  views[5] = others[0], views[9] = others[1];
  HandEyeOptions options;
  options.limits.gated_last_max = 0;
  const auto result = calibrate_hand_eye(setup.camera, setup.board, views, options);
  REQUIRE(result);
  CHECK(result->verdict == Verdict::kAccepted);
  CHECK(result->views == 14);
}

TEST_CASE("pose pairs: no pixels, the same verdicts", "[calibration]") {
  const Setup setup;
  Random random(23);
  const auto pairs = test::observe_pairs(setup, 20, random);
  const auto result = calibrate_hand_eye_from_pairs(pairs);
  REQUIRE(result);
  CHECK(result->verdict == Verdict::kAccepted);
  CHECK(result->from_pairs);
  CHECK(result->holdout_rms_px == 0);
  CHECK(result->holdout_rms_m > 0);
}

TEST_CASE("both solvers lead to the same refinement", "[calibration]") {
  const Setup setup;
  Random random(24);
  const auto views = test::observe_views(setup, 15, random);
  HandEyeOptions options;
  const auto park = solve_hand_eye(setup.camera, setup.board, views, options);
  options.solver = Solver::kTsaiLenz;
  const auto tsai = solve_hand_eye(setup.camera, setup.board, views, options);
  REQUIRE(park);
  REQUIRE(tsai);
  CHECK(pose_difference(park->closed_form.pose(), tsai->closed_form.pose()).norm() > 0);
  CHECK(pose_difference(park->flange_T_camera.pose(), tsai->flange_T_camera.pose()).norm() < 2e-5);
}
