#include "algorithms/calibration/touch_test.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/calibration/verdict.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/unit/calibration/synthetic_touches.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using test::Setup;
using test::Toucher;

namespace {

/// A calibration from rendered views, as the jobs make it.
struct Calibrated {
  CalibratedBoard board;
  std::vector<PosePair> views;
  ArmSigma arm_sigma;
};

Calibrated calibrate(const Setup& said, const std::vector<CalibrationView>& views) {
  HandEyeOptions options;
  options.refinement.arm_sigma_expected = said.arm_sigma;
  const auto result = solve_hand_eye(said.camera, said.board, views, options);
  if (!result) FAIL(result.error().detail());
  return {{result->flange_T_camera, result->base_T_board, result->board_covariance},
          used_pairs(said.camera, said.board, views, *result),
          result->arm_sigma};
}

TouchTest touch_tested(const Setup& s, const BoardSpec& board, const Calibrated& calibrated,
                       const std::vector<Touch>& touches, const std::optional<TipOffset>& tip) {
  TouchOptions options;
  options.tip = tip;
  options.arm_sigma = s.arm_sigma;
  auto touched = locate_touched_board(board, touches, options);
  if (!touched) FAIL(touched.error().detail());
  return test_by_touch(board, std::move(*touched), calibrated.board, calibrated.views);
}

std::string all_reasons(const TouchTest& test) {
  std::string text;
  for (const std::string& reason : test.reasons) text += reason + "; ";
  return text;
}

}  // namespace

TEST_CASE("right calibrations agree with touches as often as stated, and the errors are those expected",
          "[calibration]") {
  const Setup s;
  const Toucher toucher;
  constexpr int kTrials = test::trials(80);
  Random random(21);
  double chi2 = 0, normalised_mm = 0, normalised_mrad = 0;
  int disagree = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Calibrated calibrated = calibrate(s, test::observe_views(s, 15, random));
    const bool estimate_tip = trial % 2 == 1;
    const auto tip = estimate_tip ? std::optional<TipOffset>() : test::measured_tip(toucher, 2e-4, random);
    const auto touches = test::touch(s, toucher, test::spread_corners(s.board, 2), random);
    const TouchTest test = touch_tested(s, s.board, calibrated, touches, tip);
    CAPTURE(trial, all_reasons(test));
    chi2 += test.chi2 / kTrials;
    for (Eigen::Index i = 0; i < 3; ++i) {
      normalised_mm += std::pow(test.mean[i] / test.mean_sigma[i], 2) / kTrials;
      normalised_mrad += std::pow(test.mean[i + 3] / test.mean_sigma[i + 3], 2) / kTrials;
    }
    if (!test.agrees()) ++disagree;
    CHECK(test.places == static_cast<int>(calibrated.views.size()));
    CHECK(test.errors.size() == calibrated.views.size());
    CHECK(test.static_looks == 0);
    // What a view says differs from the mean by corner noise (0.1 px at 0.7 m) and the arm's deviation.
    CHECK(test.view_deviation.head<3>().maxCoeff() < 3e-3);
    CHECK(test.view_deviation.head<3>().minCoeff() > 1e-4);
  }
  const double wider = test::margin_factor();
  CHECK(chi2 == Approx(6).margin(1.3 * wider));  // standard deviation of the mean 0.39
  CHECK(normalised_mm == Approx(3).margin(1.2 * wider));
  CHECK(normalised_mrad == Approx(3).margin(1.2 * wider));
  CHECK(disagree == 0);
}

TEST_CASE("the error of a wrong hand-eye transform is found, with its size and direction", "[calibration]") {
  const Setup s;
  const Toucher toucher;
  Random random(22);
  for (int trial = 0; trial < 20; ++trial) {
    Calibrated wrong = calibrate(s, test::observe_views(s, 15, random));
    // The camera is thought to be elsewhere by so much in its own axes, and the board where the views then put it.
    Vector6d error;
    error << 0.006 * random.direction(), 0.004 * random.direction();
    const Pose camera_T_wrong = perturb(Pose::Identity(), error);
    wrong.board.flange_T_camera = Transform<Flange, Camera>(wrong.board.flange_T_camera.pose() * camera_T_wrong);
    wrong.board.base_T_board = mean_board_pose(wrong.views, wrong.board.flange_T_camera);
    const auto touches = test::touch(s, toucher, test::spread_corners(s.board, 2), random);
    const TouchTest test = touch_tested(s, s.board, wrong, touches, test::measured_tip(toucher, 2e-4, random));
    REQUIRE_FALSE(test.agrees());
    CHECK_THAT(test.reasons[0], Contains("contradicts the calibration") && Contains("chi-square"));
    const Vector6d found = pose_difference(camera_T_wrong.inverse(Eigen::Isometry), Pose::Identity());
    for (Eigen::Index i = 0; i < 6; ++i) {
      CAPTURE(i, test.mean[i], found[i], test.mean_sigma[i]);
      CHECK(std::abs(test.mean[i] - found[i]) < 4.5 * test.mean_sigma[i]);
    }
  }
}

TEST_CASE("a board that was moved after the views is found", "[calibration]") {
  const Setup s;
  const Toucher toucher;
  Random random(27);
  const Calibrated calibrated = calibrate(s, test::observe_views(s, 15, random));
  Setup moved = s;
  moved.base_T_board.pretranslate(Eigen::Vector3d(0, 0.003, 0));
  const auto touches = test::touch(moved, toucher, test::spread_corners(s.board, 2), random);
  const TouchTest test = touch_tested(s, s.board, calibrated, touches, test::measured_tip(toucher, 2e-4, random));
  REQUIRE_FALSE(test.agrees());
  CHECK_THAT(test.reasons[0], Contains("contradicts the calibration"));
  CHECK(test.shift.head<3>().norm() == Approx(0.003).margin(0.001));
}

TEST_CASE("what the person at the arm did wrong is named", "[calibration]") {
  Setup s;
  s.board = {9, 6, 0.03};  // looks the same in one way only
  const Toucher toucher;
  Random random(23);
  const Calibrated calibrated = calibrate(s, test::observe_views(s, 15, random));
  const auto corners = test::spread_corners(s.board, 2);
  const TipOffset tip = test::measured_tip(toucher, 2e-4, random);
  const int columns = s.board.inner_columns, rows = s.board.inner_rows;

  const auto recounted = [&](bool other_column, bool other_row) {
    auto touches = test::touch(s, toucher, corners, random);
    for (Touch& t : touches) {
      const int column = t.corner % columns, row = t.corner / columns;
      t.corner = (other_row ? rows - 1 - row : row) * columns + (other_column ? columns - 1 - column : column);
    }
    return all_reasons(touch_tested(s, s.board, calibrated, touches, tip));
  };
  CHECK_THAT(recounted(true, true), Contains("counted with columns and rows both from the other end"));
  CHECK_THAT(recounted(true, false), Contains("counted with columns from the other end"));
  CHECK_THAT(recounted(false, true), Contains("counted with rows from the other end"));

  // A board printed 1 % too large, for the camera and for the hand.
  Setup printed = s;
  printed.board.square_size_m *= 1.01;
  const Calibrated misled = calibrate(s, test::observe_views(printed, 15, random));
  const auto touches = test::touch(printed, toucher, corners, random);
  CHECK_THAT(all_reasons(touch_tested(s, s.board, misled, touches, tip)),
             Contains("% farther apart than the board's size says"));

  TipOffset wrong = tip;
  wrong.flange_p_tip_m.z() += 0.004;
  CHECK_THAT(all_reasons(touch_tested(s, s.board, calibrated, test::touch(s, toucher, corners, random), wrong)),
             Contains("the tip is not where it was said to be"));
}

TEST_CASE("touches too coarse or too few for a test do not pass one", "[calibration]") {
  const Setup s;
  Random random(24);
  const Calibrated calibrated = calibrate(s, test::observe_views(s, 15, random));
  Toucher coarse;
  coarse.hand_sigma_m = 0.004;
  TouchOptions options;
  options.tip = TipOffset{coarse.flange_p_tip_m, 1e-4};
  options.touch_sigma_m = 0.004;
  auto touched =
      locate_touched_board(s.board, test::touch(s, coarse, test::spread_corners(s.board, 3), random), options);
  REQUIRE(touched);
  TouchTestLimits limits;
  limits.error_max_m = 0.05;  // not exceeded
  limits.error_max_rad = 0.1;
  const TouchTest test = test_by_touch(s.board, *touched, calibrated.board, calibrated.views, limits);
  CHECK_THAT(all_reasons(test), Contains("too few, too near to each other or too coarse") && Contains("3 sigma"));
  CHECK_THAT(all_reasons(test), !Contains("contradicts"));
}

TEST_CASE("repeated looks from one place tell the scatter of the camera alone", "[calibration]") {
  const Setup s;
  const Toucher toucher;
  Random random(25);
  const Calibrated calibrated = calibrate(s, test::observe_views(s, 15, random));
  const auto touches = test::touch(s, toucher, test::spread_corners(s.board, 2), random);
  TouchOptions options;
  options.tip = TipOffset{toucher.flange_p_tip_m, 1e-4};
  const auto touched = locate_touched_board(s.board, touches, options);
  REQUIRE(touched);
  // Ten looks from each of the places; the camera scatters by 1 mm along its x and 2 mrad about its z.
  std::vector<PosePair> looks;
  for (const PosePair& view : calibrated.views) {
    for (int k = 0; k < 10; ++k) {
      PosePair look = view;
      Vector6d scatter = Vector6d::Zero();
      scatter[0] = 1e-3 * random.normal();
      const double turn = 2e-3 * random.normal();
      Pose moved = perturb(view.camera_T_board.pose(), scatter);
      Pose about_z = Pose::Identity();
      about_z.linear() = rotation_exp({0, 0, turn});
      look.camera_T_board = Transform<Camera, Board>(about_z * moved);
      looks.push_back(look);
    }
  }
  const TouchTest once = test_by_touch(s.board, *touched, calibrated.board, calibrated.views);
  const TouchTest test = test_by_touch(s.board, *touched, calibrated.board, looks);
  CHECK(test.places == static_cast<int>(calibrated.views.size()));
  CHECK(test.static_looks == static_cast<int>(looks.size()));
  CHECK(test.errors.size() == looks.size());
  CHECK(test.static_deviation[0] == Approx(1e-3).epsilon(0.2));
  CHECK(test.static_deviation[2] < 1e-4);
  CHECK(test.static_deviation[5] == Approx(2e-3).epsilon(0.2));
  CHECK((test.mean - once.mean).head<3>().norm() < 4e-4);  // a place counts once, however often it was looked from
  CHECK(once.static_deviation == CameraError::Zero());
}

TEST_CASE("a board that looks the same upside down may be counted from either end", "[calibration]") {
  Setup s;
  s.board = {8, 8, 0.025};
  const Toucher toucher;
  Random random(26);
  const Calibrated calibrated = calibrate(s, test::observe_views(s, 15, random));
  auto touches = test::touch(s, toucher, {0, 7, 56, 63, 19, 44}, random);
  for (Touch& t : touches) t.corner = s.board.corners() - 1 - t.corner;
  const TouchTest test = touch_tested(s, s.board, calibrated, touches, test::measured_tip(toucher, 2e-4, random));
  INFO(all_reasons(test));
  CHECK(test.chi2 < test.chi2_limit);
  CHECK_THAT(all_reasons(test), !Contains("likely mistake"));
}
