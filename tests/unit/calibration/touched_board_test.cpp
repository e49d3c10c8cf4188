#include "algorithms/calibration/touched_board.hpp"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <string>

#include "algorithms/calibration/chi_square.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/unit/calibration/synthetic_touches.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using test::kDegree;
using test::Setup;
using test::Toucher;

namespace {

TouchedBoard located(const Setup& s, const std::vector<Touch>& touches, const TouchOptions& options) {
  const auto result = locate_touched_board(s.board, touches, options);
  if (!result) FAIL(result.error().detail());
  return *result;
}

std::string refusal(const Setup& s, const std::vector<Touch>& touches, const TouchOptions& options = {}) {
  const auto result = locate_touched_board(s.board, touches, options);
  if (result) return "located";
  CHECK(result.error().fault == Fault::kTouchesUnusable);
  return std::string(result.error().detail());
}

/// Mean over the trials of the board's normalised error squared (6 when the covariance is honest), and the tip's (3).
struct Normalised {
  double board = 0, tip = 0, left_out = 0;
};

Normalised normalised(const Setup& s, const Toucher& toucher, const std::vector<int>& corners, bool tip_given,
                      bool together = true, int count = 600) {
  const int trials = test::trials(count);
  Random random(11);
  Normalised sum;
  for (int trial = 0; trial < trials; ++trial) {
    const auto touches = test::touch(s, toucher, corners, random, together);
    TouchOptions options;
    if (tip_given) options.tip = test::measured_tip(toucher, 2e-4, random);
    options.arm_sigma = s.arm_sigma;
    const TouchedBoard board = located(s, touches, options);
    const Vector6d e = pose_difference(s.base_T_board, board.base_T_board.pose());
    sum.board += e.dot(board.covariance.ldlt().solve(e)) / trials;
    sum.tip += (toucher.flange_p_tip_m - board.flange_p_tip_m).cwiseQuotient(board.tip_sigma_m).squaredNorm() / trials;
    sum.left_out += static_cast<double>(corners.size()) - board.used;
  }
  return sum;
}

}  // namespace

TEST_CASE("touches without noise give board and tip exactly", "[calibration]") {
  Setup s;
  s.arm_sigma = {0, 0};
  Toucher toucher;
  toucher.hand_sigma_m = 0;
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    toucher.flange_p_tip_m = 0.15 * random.normal3();
    const auto touches = test::touch(s, toucher, test::spread_corners(s.board, 2), random);
    for (const bool given : {true, false}) {
      TouchOptions options;
      if (given) options.tip = TipOffset{toucher.flange_p_tip_m, 1e-4};
      const TouchedBoard board = located(s, touches, options);
      CHECK(pose_difference(s.base_T_board, board.base_T_board.pose()).norm() < 1e-8);
      CHECK((board.flange_p_tip_m - toucher.flange_p_tip_m).norm() < 1e-8);
      CHECK(board.horn_residual_rms_m < 1e-8);
      CHECK(board.tip_estimated != given);
      CHECK(board.used == static_cast<int>(touches.size()));
    }
  }
}

TEST_CASE("the covariance of a touched board is honest, the tip given or estimated", "[calibration]") {
  const Setup s;
  const double wider = test::margin_factor();
  for (const bool tip_given : {true, false}) {
    for (const int step : {2, 3}) {  // 12 corners, and 6
      CAPTURE(tip_given, step);
      const Normalised n = normalised(s, {}, test::spread_corners(s.board, step), tip_given);
      // Standard deviation of the mean of 600: sqrt(12 / 600) = 0.14, and few touches know their sigma roughly.
      CHECK(n.board == Approx(6).margin((step == 2 ? 0.6 : 1.0) * wider));
      CHECK(n.tip == Approx(3).margin(0.6 * wider));
      CHECK(n.left_out == 0);
    }
  }
}

TEST_CASE("an unsteadier hand shows, and an arm that deviates from touch to touch is no less honest", "[calibration]") {
  const Setup s;
  Toucher unsteady;
  unsteady.hand_sigma_m = 6e-4;
  const auto corners = test::spread_corners(s.board, 2);
  CHECK(normalised(s, unsteady, corners, true).board == Approx(6).margin(2));
  const double apart = normalised(s, {}, corners, true, false).board;
  CHECK(apart > 3);
  CHECK(apart < 6.5);
  Random random(5);
  double shown = 0;
  for (int trial = 0; trial < 50; ++trial) {
    shown += located(s, test::touch(s, unsteady, corners, random), {}).touch_sigma_m / 50;
  }
  CHECK(shown == Approx(5.5e-4).margin(0.5e-4));
}

TEST_CASE("residuals after Horn are those of the hand", "[calibration]") {
  const Setup s;
  const Toucher toucher;
  Random random(6);
  double squared = 0;
  for (int trial = 0; trial < 200; ++trial) {
    TouchOptions options;
    options.tip = TipOffset{toucher.flange_p_tip_m, 1e-7};
    const TouchedBoard board = located(s, test::touch(s, toucher, test::spread_corners(s.board, 2), random), options);
    squared += board.horn_residual_rms_m * board.horn_residual_rms_m / 200;
    CHECK(board.residual_rms_m == Approx(board.horn_residual_rms_m).epsilon(0.01));
    CHECK(board.residual_max_m > board.residual_rms_m);
    CHECK(std::abs(board.scale - 1) < 5 * board.scale_sigma);
    CHECK(board.scale_sigma < 2e-3);
  }
  // 12 touches have 36 coordinates and leave 30 degrees of freedom.
  CHECK(std::sqrt(squared) == Approx(toucher.hand_sigma_m * std::sqrt(30.0 / 12)).epsilon(0.05));
}

TEST_CASE("wrong touches are left out and named", "[calibration]") {
  const Setup s;
  const Toucher toucher;
  Random random(7);
  for (const bool tip_given : {true, false}) {
    for (int trial = 0; trial < test::trials(60); ++trial) {
      CAPTURE(tip_given, trial);
      auto touches = test::touch(s, toucher, test::spread_corners(s.board, 2), random);
      // One said to be its neighbour in the row, one whose tip slipped by 10 mm.
      const auto mixed_up = static_cast<std::size_t>(random.below(12));
      const std::size_t slipped = (mixed_up + 1 + static_cast<std::size_t>(random.below(11))) % 12;
      const int stood_on = touches[mixed_up].corner;
      touches[mixed_up].corner += stood_on % s.board.inner_columns == 0 ? 1 : -1;
      Pose pose = touches[slipped].base_T_flange.pose();
      pose.translation() += 0.01 * random.direction();
      touches[slipped].base_T_flange = Transform<Base, Flange>(pose);
      TouchOptions options;
      options.arm_sigma = s.arm_sigma;
      if (tip_given) options.tip = test::measured_tip(toucher, 2e-4, random);
      const TouchedBoard board = located(s, touches, options);
      CHECK(board.used == 10);
      CHECK_FALSE(board.fits[mixed_up].used);
      CHECK_FALSE(board.fits[slipped].used);
      CHECK(board.fits[mixed_up].rather == stood_on);
      CHECK(board.fits[slipped].off_m.norm() == Approx(0.01).margin(0.003));
      const Vector6d e = pose_difference(s.base_T_board, board.base_T_board.pose());
      CHECK(e.dot(board.covariance.ldlt().solve(e)) < chi_square_quantile(0.9999, 6));
    }
  }
  CHECK(corner_name(s.board, 19) == "corner (3, 2)");
}

TEST_CASE("touches that do not determine the board are refused by name", "[calibration]") {
  const Setup s;
  Random random(8);
  const auto corners = test::spread_corners(s.board, 2);
  Toucher toucher;
  TouchOptions given;
  given.tip = TipOffset{toucher.flange_p_tip_m, 2e-4};

  SECTION("one orientation leaves the tip open, and a given tip closes it") {
    toucher.tilt_max_rad = 0.5 * kDegree;
    const auto touches = test::touch(s, toucher, corners, random);
    CHECK_THAT(refusal(s, touches), Contains("one orientation") && Contains("give the tip's offset"));
    CHECK(refusal(s, touches, given) == "located");
  }
  SECTION("tilts about one axis leave it open along that axis") {
    toucher.tilt_axes = {0, 1, 0};
    toucher.hand_sigma_m = 1e-4;
    CHECK_THAT(refusal(s, test::touch(s, toucher, corners, random)),
               Contains("open along (") && Contains(", 1.00, ") && Contains("about another axis"));
  }
  SECTION("corners on a line") {
    CHECK_THAT(refusal(s, test::touch(s, toucher, {0, 1, 2, 3, 5, 7}, random), given), Contains("lie on a line"));
    CHECK_THAT(refusal(s, test::touch(s, toucher, {0, 9, 18, 27}, random), given), Contains("lie on a line"));
  }
  SECTION("too few, counted") {
    CHECK_THAT(refusal(s, test::touch(s, toucher, {0, 7}, random), given), Contains("2 touches, 3 are the least"));
    CHECK_THAT(refusal(s, test::touch(s, toucher, {0, 7, 40}, random)), Contains("3 touches, 4 are the least when"));
    CHECK(refusal(s, test::touch(s, toucher, {0, 7, 40}, random), given) == "located");
  }
  SECTION("touches that contradict each other") {
    auto touches = test::touch(s, toucher, corners, random);
    for (std::size_t i = 0; i < 6; ++i) {
      Pose pose = touches[i].base_T_flange.pose();
      pose.translation() += 0.02 * random.direction();
      touches[i].base_T_flange = Transform<Base, Flange>(pose);
    }
    CHECK_THAT(refusal(s, touches, given), Contains("contradict each other"));
  }
  SECTION("data that cannot be") {
    auto touches = test::touch(s, toucher, {0, 7, 40, 47}, random);
    touches[2].corner = 48;
    auto result = locate_touched_board(s.board, touches, given);
    REQUIRE_FALSE(result);
    CHECK(result.error().fault == Fault::kDataMalformed);
    CHECK_THAT(std::string(result.error().detail()), Contains("touch 3: point 48 of a board with 48"));
    const std::vector<Touch> many(21, touches[0]);
    result = locate_touched_board(s.board, many, given);
    REQUIRE_FALSE(result);
    CHECK_THAT(std::string(result.error().detail()), Contains("21 touches, 20 are the most"));
    touches[2].corner = 40;
    Pose broken = touches[1].base_T_flange.pose();
    broken.translation().x() = std::numeric_limits<double>::quiet_NaN();
    touches[1].base_T_flange = Transform<Base, Flange>(broken);
    result = locate_touched_board(s.board, touches, given);
    REQUIRE_FALSE(result);
    CHECK_THAT(std::string(result.error().detail()), Contains("touch 2: a pose that is not finite"));
  }
}

TEST_CASE("the same touches give the same bits", "[calibration]") {
  const Setup s;
  Random random(9);
  auto touches = test::touch(s, {}, test::spread_corners(s.board, 2), random);
  touches[4].corner = 47;
  const TouchedBoard first = located(s, touches, {}), again = located(s, touches, {});
  CHECK(first.base_T_board.pose().matrix() == again.base_T_board.pose().matrix());
  CHECK(first.covariance == again.covariance);
}
