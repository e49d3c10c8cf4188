#include "algorithms/view_planning/base_turns.hpp"

#include <array>
#include <catch2/catch.hpp>

using namespace firstlook;

namespace {
constexpr double kTurn_rad = 6.283185307179586;
const ArmModel kUr5 = *find_arm_model("ur5");
}  // namespace

TEST_CASE("one round covers a full turn in equal steps from the start", "[base_turns]") {
  const JointVector start = default_start(kUr5);
  const Turns turns = base_turns(kUr5, start, 0.6, std::array{0.0});
  REQUIRE(turns.size() == 11);
  REQUIRE(turns.front() == start);
  for (std::size_t i = 1; i < turns.size(); ++i) {
    REQUIRE(std::abs(turns[i][0] - turns[i - 1][0]) == Approx(kTurn_rad / 11));
    for (int j = 1; j < 6; ++j) REQUIRE(turns[i][j] == start[j]);
  }
}

TEST_CASE("rounds turn to and fro inside the limits, wherever they start", "[base_turns]") {
  for (const double base : {-6.2, -3.0, 0.0, 2.0, 6.2}) {
    JointVector start = default_start(kUr5);
    start[0] = base;
    const Turns turns = base_turns(kUr5, start, 0.7, std::array{0.0, 0.4, -0.4});
    REQUIRE(turns.size() == 27);
    for (std::size_t i = 0; i < turns.size(); ++i) {
      REQUIRE(turns[i][0] <= kUr5.upper_rad[0]);
      REQUIRE(turns[i][0] >= kUr5.lower_rad[0]);
      if (i % 9 == 0) continue;
      const double step = turns[i][0] - turns[i - 1][0];
      REQUIRE(step * (turns[i - i % 9 + 1][0] - turns[i - i % 9][0]) > 0);  // one direction within a round
    }
    REQUIRE(turns[9][0] == Approx(turns[8][0]));  // no way lost between rounds
  }
}

TEST_CASE("limits of less than a turn are covered from the nearer end", "[base_turns]") {
  ArmModel arm = kUr5;
  arm.lower_rad[0] = -1;
  arm.upper_rad[0] = 2;
  JointVector start = default_start(arm);
  start[0] = 1.2;
  const Turns turns = base_turns(arm, start, 0.8, std::array{0.0});
  REQUIRE(turns.front()[0] == Approx(2));
  REQUIRE(turns.back()[0] == Approx(-1));
  for (std::size_t i = 1; i < turns.size(); ++i) REQUIRE(turns[i - 1][0] - turns[i][0] <= 0.8 + 1e-12);
}

TEST_CASE("the tilt joint raises the view by its sign", "[base_turns]") {
  const JointVector start = default_start(kUr5);
  const TiltJoint tilt = tilt_joint(kUr5, start);
  REQUIRE(tilt.joint == 3);
  JointVector up = start;
  up[tilt.joint] += 0.3 * tilt.up_sign;
  const double before = forward(kUr5, start).flange().rotation().col(2).z();
  const double after = forward(kUr5, up).flange().rotation().col(2).z();
  REQUIRE(after > before + 0.1);
}

TEST_CASE("more views than fit are cut", "[base_turns]") {
  REQUIRE(base_turns(kUr5, default_start(kUr5), 0.2, std::array{0.0, 0.1, 0.2, 0.3}).size() == kTurnsMax);
}

TEST_CASE("the outermost of parallel joints tilts an arm that was measured, too", "[base_turns]") {
  ArmModel measured = kUr5;
  for (std::size_t j = 0; j < 6; ++j) {
    measured.dh[j].alpha_rad += (j % 2 == 0 ? 4e-4 : -7e-4);
    measured.dh[j].theta_offset_rad += 5e-4;
  }
  REQUIRE(tilt_joint(measured, default_start(measured)).joint == 3);
}
