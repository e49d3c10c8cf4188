#include "algorithms/calibration/verification.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <string>

#include "algorithms/calibration/chi_square.hpp"
#include "algorithms/calibration/verdict.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using test::kDegree;
using test::Setup;

namespace {

/// Where a cart may look from: nearer, and tilted and rolled more than a calibration's average view.
Setup cart() {
  Setup s;
  s.tilt_max_rad = 45 * kDegree;
  s.roll_max_rad = 180 * kDegree;
  s.distance_min_m = 0.35;
  s.distance_max_m = 0.8;
  return s;
}

Matrix6d covariance_of(const Setup& s, const std::vector<Pose>& flanges) {
  Matrix12d information = prior_information();
  for (const Pose& flange : flanges) information += view_information(s.model(), Transform<Base, Flange>(flange));
  return predicted_covariance(information);
}

/// Views as a cart chooses them: where the board was found, then each time the best of 200 by design_volume.
std::vector<Pose> diverse_flanges(const Setup& s, std::size_t count = 3) {
  Random random(7);
  std::vector<Pose> flanges{test::flange_for(s, test::random_camera_T_board(s, random))};
  while (flanges.size() < count) {
    Pose best;
    double best_volume = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 200; ++i) {
      auto tried = flanges;
      tried.push_back(test::flange_for(s, test::random_camera_T_board(s, random)));
      const double volume = design_volume(covariance_of(s, tried));
      if (volume < best_volume) {
        best_volume = volume;
        best = tried.back();
      }
    }
    flanges.push_back(best);
  }
  return flanges;
}

std::vector<CalibrationView> observe(const Setup& s, const std::vector<Pose>& flanges, Random& random) {
  std::vector<CalibrationView> views;
  for (const Pose& flange : flanges) views.push_back(test::observe(s, flange, random));
  return views;
}

/// The covariance that 16 good views leave.
Matrix6d stored_covariance(const Setup& s) {
  Random random(77);
  Matrix12d information = prior_information();
  for (int i = 0; i < 16; ++i) {
    const Pose flange = test::flange_for(s, test::random_camera_T_board(s, random));
    information += view_information(s.model(), Transform<Base, Flange>(flange));
  }
  return predicted_covariance(information);
}

/// A calibration that errs as its covariance says.
HandEyeClaim honest_claim(const Setup& s, const Matrix6d& covariance, Random& random) {
  Vector6d normal;
  normal << random.normal3(), random.normal3();
  const Matrix6d root = covariance.llt().matrixL();
  HandEyeClaim claim;
  claim.flange_T_camera = Transform<Flange, Camera>(perturb(s.flange_T_camera, root * normal));
  claim.covariance = covariance;
  claim.corner_sigma_px = s.corner_sigma_px;
  claim.arm_sigma = s.arm_sigma;
  return claim;
}

HandEyeClaim shifted(HandEyeClaim claim, const Vector6d& error) {
  claim.flange_T_camera = Transform<Flange, Camera>(perturb(claim.flange_T_camera.pose(), error));
  return claim;
}

Verification verified(const Setup& s, const std::vector<CalibrationView>& views, const HandEyeClaim& claim,
                      const VerificationLimits& limits = {}) {
  const auto result = verify_hand_eye(s.camera, s.board, views, claim, limits);
  if (!result) FAIL(result.error().detail());
  return *result;
}

}  // namespace

TEST_CASE("a right calibration passes at the stated rate", "[calibration]") {
  const Setup s = cart();
  const auto flanges = diverse_flanges(s);
  const Matrix6d covariance = stored_covariance(s);
  VerificationLimits often;
  often.significance = 0.05;
  constexpr int kTrials = test::trials(1000);
  Random random(41);
  int fails_often = 0, fails = 0;
  double sum = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto views = observe(s, flanges, random);
    const HandEyeClaim claim = honest_claim(s, covariance, random);
    const Verification result = verified(s, views, claim);
    sum += result.chi2;
    if (!result.holds) ++fails;
    if (!verified(s, views, claim, often).holds) ++fails_often;
  }
  // Mean 12; standard deviation of the mean over 1000 trials sqrt(24 / 1000) = 0.15.
  const double wider = test::margin_factor();
  CHECK(sum / kTrials == Approx(12).margin(0.5 * wider));
  // Of 1000 50 are expected, binomial standard deviation 6.9; and 1.
  CHECK(fails_often > (50 - 25 * wider) * kTrials / 1000);
  CHECK(fails_often < (50 + 25 * wider) * kTrials / 1000);
  CHECK(fails <= 5);
}

TEST_CASE("what a whole calibration leaves passes its own verification", "[calibration]") {
  const Setup s = cart();
  Random random(42);
  int fails = 0;
  for (int trial = 0; trial < 25; ++trial) {
    const auto solved = solve_hand_eye(s.camera, s.board, test::observe_views(s, 16, random));
    REQUIRE(solved);
    HandEyeClaim claim{solved->flange_T_camera, solved->covariance, solved->corner_sigma_px, solved->arm_sigma};
    claim.corner_sigma_px = std::max(claim.corner_sigma_px, s.corner_sigma_px);
    claim.arm_sigma.translation_m = std::max(claim.arm_sigma.translation_m, s.arm_sigma.translation_m);
    claim.arm_sigma.rotation_rad = std::max(claim.arm_sigma.rotation_rad, s.arm_sigma.rotation_rad);
    if (!verified(s, observe(s, diverse_flanges(s), random), claim).holds) ++fails;
  }
  CHECK(fails == 0);
}

TEST_CASE("a mount that moved by 5 mm or 1 degree in any direction is found", "[calibration]") {
  const Setup s = cart();
  const auto flanges = diverse_flanges(s);
  const Matrix6d covariance = stored_covariance(s);
  Random random(43);
  for (int trial = 0; trial < 100; ++trial) {
    const HandEyeClaim claim = honest_claim(s, covariance, random);
    const auto views = observe(s, flanges, random);
    const Eigen::Vector3d direction = random.direction();
    Vector6d moved = Vector6d::Zero(), turned = Vector6d::Zero(), both = Vector6d::Zero();
    moved.head<3>() = 0.005 * direction;
    turned.tail<3>() = kDegree * direction;
    both << 0.005 * direction, kDegree * random.direction();
    for (const Vector6d& error : {moved, turned, both}) {
      const Verification result = verified(s, views, shifted(claim, error));
      CHECK_FALSE(result.holds);
      CHECK(result.chi2 > 2 * result.chi2_limit);
      REQUIRE(result.reasons.size() == 2);
      CHECK_THAT(result.reasons[0], Contains("chi-square") && Contains("allowed 32.9"));
      CHECK_THAT(result.reasons[1], Contains("mm and"));
    }
  }
}

TEST_CASE("the detectable error is what the test finds 99 times in 100", "[calibration]") {
  const Setup s = cart();
  const auto flanges = diverse_flanges(s);
  const Matrix6d covariance = stored_covariance(s);
  Random random(44);
  // The worst direction: the translation with the largest variance, and the rotation that hides it best.
  Matrix12d information = prior_information();
  for (const Pose& flange : flanges) information += view_information(s.model(), Transform<Base, Flange>(flange));
  const Matrix6d sum = predicted_covariance(information) + covariance;
  const DetectableError detectable = detectable_error(predicted_covariance(information), covariance, 3);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(Eigen::Matrix3d(sum.topLeftCorner<3, 3>()));
  Vector6d error;
  error.head<3>() = detectable.translation_m * eigen.eigenvectors().col(2);
  error.tail<3>() = sum.bottomLeftCorner<3, 3>() * sum.topLeftCorner<3, 3>().inverse() * error.head<3>();
  CHECK(detectable.translation_m < 0.004);
  CHECK(detectable.rotation_rad < 0.008);
  constexpr int kTrials = test::trials(1000);
  int found = 0, found_half = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const HandEyeClaim claim = honest_claim(s, covariance, random);
    const auto views = observe(s, flanges, random);
    if (!verified(s, views, shifted(claim, error)).holds) ++found;
    if (!verified(s, views, shifted(claim, 0.5 * error)).holds) ++found_half;
  }
  CHECK(found >= (990 - 10 * test::margin_factor()) * kTrials / 1000);
  CHECK(found_half < 0.6 * kTrials);
}

TEST_CASE("views that could not disagree do not pass", "[calibration]") {
  const Setup s = cart();
  Random random(45);
  const HandEyeClaim claim = honest_claim(s, stored_covariance(s), random);
  std::vector<Pose> shifted_only, rolled_only;
  for (const double step : {-1.0, 0.0, 1.0}) {
    Pose pose = Pose::Identity();
    pose.translation() = Eigen::Vector3d(0.08 * step, 0.05, 0.6 + 0.1 * step) - s.board.center();
    shifted_only.push_back(test::flange_for(s, pose));
    pose.linear() = rotation_exp({0, 0, 0.5 * step});
    pose.translation() = Eigen::Vector3d(0, 0, 0.6) - pose.linear() * s.board.center();
    rolled_only.push_back(test::flange_for(s, pose));
  }
  // Without rotation no error of the translation shows; with one axis none along it.
  Vector6d error = Vector6d::Zero();
  error.head<3>() = 0.02 * s.flange_T_camera.linear().col(2);
  for (const auto& flanges : {shifted_only, rolled_only}) {
    const auto views = observe(s, flanges, random);
    for (const HandEyeClaim& c : {claim, shifted(claim, error)}) {
      const Verification result = verified(s, views, c);
      CHECK(result.chi2 <= result.chi2_limit);
      CHECK_FALSE(result.holds);
      CHECK(result.detectable.translation_m > 0.02);
      REQUIRE_FALSE(result.reasons.empty());
      CHECK_THAT(result.reasons[0], Contains("too much alike") && Contains("allowed 5 mm"));
    }
  }
  Vector6d worse = error;
  worse.head<3>() *= 100;  // 2 m: still nothing shows
  CHECK(verified(s, observe(s, shifted_only, random), shifted(claim, worse)).chi2 < 40);
}

TEST_CASE("residuals of the views are those of a standing board", "[calibration]") {
  const Setup s = cart();
  Random random(46);
  const HandEyeClaim claim = honest_claim(s, stored_covariance(s), random);
  const auto views = observe(s, diverse_flanges(s), random);
  const Verification good = verified(s, views, claim);
  REQUIRE(good.views.size() == 3);
  CHECK(good.holds);
  CHECK(good.reasons.empty());
  CHECK(good.residual_rms_m < 0.5e-3);
  CHECK(good.residual_rms_px < 0.6);
  CHECK(good.degrees_of_freedom == 12);
  // The board stands where it stands, as far as the calibration's and the arm's errors let it be known.
  const Vector6d off = pose_difference(s.base_T_board, good.targets[0].base_T_board.pose());
  CHECK(off.dot(good.targets[0].covariance.ldlt().solve(off)) < chi_square_quantile(0.9999, 6));

  Vector6d error = Vector6d::Zero();
  error[1] = 0.01;
  const Verification bad = verified(s, views, shifted(claim, error));
  CHECK(bad.residual_rms_m > 2e-3);
  CHECK(bad.residual_rms_px > 2);
}

TEST_CASE("too few views, and views without a board, are refused", "[calibration]") {
  const Setup s = cart();
  Random random(47);
  const HandEyeClaim claim = honest_claim(s, stored_covariance(s), random);
  auto views = observe(s, diverse_flanges(s), random);
  views[1].corners_px.pop_back();
  const auto two = verify_hand_eye(s.camera, s.board, views, claim);
  REQUIRE_FALSE(two);
  CHECK(two.error().fault == Fault::kTooFewViews);
  CHECK_THAT(std::string(two.error().detail()), Contains("2 usable views"));
  HandEyeClaim broken = claim;
  broken.covariance(0, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(verify_hand_eye(s.camera, s.board, observe(s, diverse_flanges(s), random), broken));
}
