#include "hal/sim/touching_hand.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <vector>

#include "hal/sim/simulated_operator.hpp"

using namespace firstlook;
using namespace firstlook::sim;

namespace {

/// A board in reach of a UR5 with its probe.
struct Cell {
  ArmModel model = *find_arm_model("ur5");
  Scene scene;
  Faults faults;
  SimulatedArmOptions options;
  Cell() {
    Pose board = Pose::Identity();
    board.linear() = Eigen::AngleAxisd(1.8, Eigen::Vector3d(0, 1, 0)).toRotationMatrix();
    board.translation() = Eigen::Vector3d(0.75, -0.1, 0.45);
    scene.board.base_T_board = Transform<Base, Board>(board);
    options.model = model;
    options.start_rad = default_start(model);
    options.script.push_back({Instant{}, ControllerAction::kPlay});
  }
};

constexpr double kStanding_rad = 1e-6;  // an arm that still rings down a second after it came

/// Lets hand and arm run until the hand confirms; what the arm said meanwhile is in `reports`.
bool confirmed(TouchingHand& hand, SimulatedArm& arm, Instant& now, std::vector<hal::ArmState>* reports = nullptr) {
  for (int i = 0; i < 5000; ++i) {
    now = now + kReportPeriod;
    while (const auto state = arm.poll(now)) {
      if (reports != nullptr) reports->push_back(*state);
    }
    if (const auto key = hand.poll(now)) return key->action == hal::OperatorAction::kConfirm;
  }
  return false;
}

}  // namespace

TEST_CASE("the hand sets the true tip onto the true corner, tilted otherwise each time", "[sim][touch]") {
  const Cell cell;
  SimulatedArm arm(cell.options);
  TouchingHand hand(cell.scene, cell.model, cell.faults, 3, arm);
  Instant now{};
  const JointVector home = arm.true_joints(now);
  std::vector<Eigen::Vector3d> tools;
  double squared = 0;
  const std::vector<int> corners = {0, 8, 45, 53, 22};
  for (const int corner : corners) {
    hand.read(fmt::format("touch 1 of 5: lead the tip onto column {}, row {}, then confirm", corner % 9, corner / 9));
    std::vector<hal::ArmState> reports;
    REQUIRE(confirmed(hand, arm, now, &reports));
    const auto flange = arm.true_flange(arm.true_joints(now));
    const Eigen::Vector3d off =
        flange * cell.scene.flange_p_tip_m - cell.scene.board.base_T_board * cell.scene.board.spec.corner(corner);
    CHECK(off.norm() < 1e-3);
    CHECK(off.norm() > 1e-6);
    squared += off.squaredNorm() / 15;
    tools.push_back(flange.rotation().col(2));
    // By hand: the joints move, no segment does.
    bool moved = false;
    for (const hal::ArmState& state : reports) {
      CHECK_FALSE(state.moving);
      moved = moved || state.velocity_rad_s.max_abs() > 0.1;
    }
    CHECK(moved);
  }
  CHECK(std::sqrt(squared) == Approx(2e-4).margin(1.2e-4));
  double largest = 0;
  for (const Eigen::Vector3d& tool : tools) largest = std::max(largest, std::acos(tool.dot(tools.front())));
  CHECK(largest > 0.15);
  hand.read("bring the arm back to where it stood, stand clear and confirm: it moves by itself then");
  REQUIRE(confirmed(hand, arm, now));
  CHECK((arm.true_joints(now) - home).max_abs() < kStanding_rad);
}

TEST_CASE("what the hand does not do", "[sim][touch]") {
  Cell cell;
  Instant now{};
  SECTION("other lines, and points that the board does not have, are not for it") {
    SimulatedArm arm(cell.options);
    TouchingHand hand(cell.scene, cell.model, cell.faults, 3, arm);
    for (const char* line :
         {"sweep view 1", "touch 1 of 2: lead the tip onto column 9, row 6, then confirm", "touch"}) {
      hand.read(line);
      CHECK(hand.next_due() == kNeverDue);
    }
  }
  SECTION("a corner out of reach is not touched and not confirmed") {
    Pose far = cell.scene.board.base_T_board.pose();
    far.translation().x() = 3;
    cell.scene.board.base_T_board = Transform<Base, Board>(far);
    SimulatedArm arm(cell.options);
    TouchingHand hand(cell.scene, cell.model, cell.faults, 3, arm);
    hand.read("touch 1 of 2: lead the tip onto column 0, row 0, then confirm");
    CHECK_FALSE(confirmed(hand, arm, now));
  }
  SECTION("mixed up, and left there") {
    cell.faults.touch_mixed_up = 1;
    cell.faults.touch_left_there = true;
    SimulatedArm arm(cell.options);
    TouchingHand hand(cell.scene, cell.model, cell.faults, 3, arm);
    hand.read("touch 1 of 2: lead the tip onto column 4, row 0, then confirm");
    REQUIRE(confirmed(hand, arm, now));
    const auto tip = arm.true_flange(arm.true_joints(now)) * cell.scene.flange_p_tip_m;
    CHECK((tip - cell.scene.board.base_T_board * cell.scene.board.spec.corner(3)).norm() < 1e-3);
    const JointVector there = arm.true_joints(now);
    hand.read("bring the arm back");
    REQUIRE(confirmed(hand, arm, now));
    CHECK((arm.true_joints(now) - there).max_abs() < kStanding_rad);
  }
}

TEST_CASE("a led arm takes no segment on the way, and a segment makes the motion the program's again", "[sim][touch]") {
  const Cell cell;
  SimulatedArm arm(cell.options);
  Instant now{seconds(1).ns};
  JointVector there = arm.true_joints(now);
  there[0] += 0.3;
  const auto led_s = arm.lead(there, 0.8, 2, now);
  REQUIRE(led_s);
  CHECK(*led_s > 0.3);
  const hal::Segment segment{1, cell.options.start_rad, 0.5, 1};
  CHECK_FALSE(arm.move(segment, now + milliseconds(50)));
  CHECK_FALSE(arm.lead(there, 0.8, 2, now + milliseconds(50)));
  now = now + seconds(*led_s + 1);
  CHECK((arm.true_joints(now) - there).max_abs() < kStanding_rad);
  REQUIRE(arm.move(segment, now));
  std::optional<hal::ArmState> last;
  while (const auto state = arm.poll(now + milliseconds(100))) last = state;
  REQUIRE(last);
  CHECK(last->moving);
  CHECK_FALSE(arm.lead(there, 0.8, 2, now + milliseconds(110)));
}

TEST_CASE("a pendant's hand reads what the program shows", "[sim][touch]") {
  const Cell cell;
  SimulatedArm arm(cell.options);
  TouchingHand hand(cell.scene, cell.model, cell.faults, 3, arm);
  SimulatedPendant pendant({}, &hand);
  CHECK_FALSE(pendant.poll(Instant{seconds(5).ns}));
  pendant.show("touch 1 of 2: lead the tip onto column 0, row 0, then confirm");
  CHECK(pendant.next_due() < Instant{seconds(5).ns});  // at once
  CHECK_FALSE(pendant.poll(Instant{seconds(60).ns}));
  CHECK(pendant.next_due() > Instant{seconds(60).ns});
  CHECK(pendant.next_due() < Instant{seconds(65).ns});
}
