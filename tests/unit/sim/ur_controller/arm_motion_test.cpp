#include "hal/sim/ur_controller/arm_motion.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "algorithms/kinematics/inverse_kinematics.hpp"

namespace firstlook {
using namespace sim::ur;

namespace {

constexpr double kCycle_s = 0.002;

struct Arm {
  ArmModel model = *find_arm_model("ur5e");
  ArmMotion motion{model, JointVector{0, -1.4, 1.6, -1.7, -1.5, 0}};  // far from singularities and limits
  double slider = 1;
  double fastest_rad_s = 0;

  /// Steps until at rest; the time it took.
  double run_until_rest(double limit_s = 60) {
    double time_s = 0;
    while (motion.busy() && time_s < limit_s) {
      REQUIRE_FALSE(motion.step(kCycle_s, slider));
      fastest_rad_s = std::max(fastest_rad_s, motion.velocity_rad_s().max_abs());
      time_s += kCycle_s;
    }
    return time_s;
  }
  void run(double s) {
    for (int i = 0; i < static_cast<int>(s / kCycle_s + 0.5); ++i) REQUIRE_FALSE(motion.step(kCycle_s, slider));
  }
  [[nodiscard]] JointVector ahead(double rad) const {
    JointVector target = motion.position_rad();
    target[0] += rad;
    target[4] -= rad / 2;
    return target;
  }
};

}  // namespace

TEST_CASE("movej takes the time of its trapezoid, or the time that was asked for", "[ur]") {
  Arm arm;
  const JointVector target = arm.ahead(1);
  const auto ticket = arm.motion.movej(target, 0.5, 1, 0);
  CHECK_FALSE(arm.motion.done(ticket));
  CHECK(arm.run_until_rest() == Approx(2.5).margin(0.003));  // 1 / 0.5 + 0.5 / 1
  CHECK(arm.motion.done(ticket));
  CHECK((arm.motion.position_rad() - target).max_abs() < 1e-12);
  CHECK(arm.fastest_rad_s == Approx(0.5).margin(1e-6));

  static_cast<void>(arm.motion.movej(arm.ahead(-1), 0.5, 4, 3));
  CHECK(arm.run_until_rest() == Approx(3).margin(0.003));
  static_cast<void>(arm.motion.movej(arm.ahead(1), 0.5, 0.1, 1));  // faster than the acceleration allows
  CHECK(arm.run_until_rest() == Approx(1).margin(0.003));
}

TEST_CASE("a line keeps the tool's centre straight, whatever the tool turns by", "[ur]") {
  Arm arm;
  Blend tool;
  tool.flange_T_tcp.translation() = Eigen::Vector3d(0.03, -0.02, 0.15);
  const auto tcp = [&] {
    return Pose(forward(arm.model, arm.motion.position_rad()).flange().pose() * tool.flange_T_tcp);
  };
  const Pose from = tcp();
  Pose to = from;
  to.translation() += Eigen::Vector3d(-0.05, 0.1, 0.08);
  to.linear() = to.linear() * Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Eigen::Vector3d way = to.translation() - from.translation();
  static_cast<void>(arm.motion.follow(ToolPath::line(from, to), 0.1, 0.5, 0, tool));
  double off_line_m = 0, time_s = 0;
  while (arm.motion.busy()) {
    REQUIRE_FALSE(arm.motion.step(kCycle_s, 1));
    time_s += kCycle_s;
    const Eigen::Vector3d at = tcp().translation() - from.translation();
    off_line_m = std::max(off_line_m, (at - way * (at.dot(way) / way.squaredNorm())).norm());
  }
  CHECK(off_line_m < 1e-8);
  CHECK(time_s == Approx(std::max(way.norm(), 0.2) / 0.1 + 0.1 / 0.5).margin(0.003));
  CHECK((tcp().matrix() - to.matrix()).norm() < 1e-7);
}

TEST_CASE("an arc goes through its three points on their circle", "[ur]") {
  Pose from = Pose::Identity(), to = from;
  from.translation() = Eigen::Vector3d(0.3, 0.1, 0.2);
  to.translation() = Eigen::Vector3d(0.4, 0.2, 0.2);  // a quarter about (0.3, 0.2, 0.2), or three the other way
  to.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d center(0.3, 0.2, 0.2);
  for (const bool near : {true, false}) {
    const Eigen::Vector3d via = near ? center + Eigen::Vector3d(0.06, -0.08, 0) : Eigen::Vector3d(0.2, 0.2, 0.2);
    const auto arc = ToolPath::arc(from, via, to, ArcTurn::kSpread);
    REQUIRE(arc);
    const double angle_rad = near ? M_PI / 2 : 3 * M_PI / 2;
    CHECK(arc->way() == Approx(std::max(0.1 * angle_rad, 0.4)));
    CHECK((arc->end().matrix() - to.matrix()).norm() < 1e-12);
    double nearest_to_via_m = 1;
    for (int i = 0; i <= 1000; ++i) {
      const Eigen::Vector3d at = arc->at(i / 1000.0).translation();
      CHECK((at - center).norm() == Approx(0.1));
      nearest_to_via_m = std::min(nearest_to_via_m, (at - via).norm());
    }
    CHECK(nearest_to_via_m < 5e-4);
    const auto fixed = ToolPath::arc(from, via, to, ArcTurn::kWithTheCircle);
    REQUIRE(fixed);
    CHECK(fixed->way() == Approx(0.1 * angle_rad));
    const Eigen::AngleAxisd turn(near ? angle_rad : -angle_rad, Eigen::Vector3d::UnitZ());
    CHECK((fixed->end().linear() - turn.toRotationMatrix()).norm() < 1e-12);
  }
  const Eigen::Vector3d between = (from.translation() + to.translation()) / 2;
  CHECK_FALSE(ToolPath::arc(from, between, to, ArcTurn::kSpread));
  CHECK_FALSE(ToolPath::arc(from, from.translation(), to, ArcTurn::kSpread));
  CHECK_FALSE(ToolPath::arc(from, between, from, ArcTurn::kSpread));
}

TEST_CASE("paths that blend go on without a stop, within the radius of the corner and no faster", "[ur]") {
  const double radius_m = GENERATE(0.01, 0.03, 0.3);
  const bool tool_path = GENERATE(true, false);
  Arm arm;
  const Blend blend{.radius_m = radius_m, .flange_T_tcp = Pose::Identity()};
  const auto at = [&](const JointVector& q) { return forward(arm.model, q).flange().pose(); };
  const Pose from = at(arm.motion.position_rad());
  Pose corner = from, to = from;
  corner.translation() += Eigen::Vector3d(-0.1, 0, 0);
  to.translation() += Eigen::Vector3d(-0.1, 0.1, 0);
  const auto joints = [&](const Pose& pose) {
    const InverseSolutions all = inverse(arm.model, Transform<Base, Flange>(pose), arm.motion.position_rad());
    return *std::ranges::min_element(all, {},
                                     [&](const JointVector& q) { return (q - arm.motion.position_rad()).max_abs(); });
  };
  const JointVector corner_rad = joints(corner), to_rad = joints(to);
  const auto first = tool_path ? arm.motion.follow(ToolPath::line(from, corner), 0.1, 0.5, 0, blend)
                               : arm.motion.movej(corner_rad, 0.3, 1, 0, blend);
  while (!arm.motion.done(first)) REQUIRE_FALSE(arm.motion.step(kCycle_s, 1));
  REQUIRE(arm.motion.blending());
  CHECK((arm.motion.path_end_rad() - corner_rad).max_abs() < 1e-6);
  CHECK((at(arm.motion.position_rad()).translation() - corner.translation()).norm() <= radius_m);
  const auto second = tool_path ? arm.motion.follow(ToolPath::line(corner, to), 0.1, 5, 0, {})
                                : arm.motion.movej(to_rad, 0.3, 5, 0, {});
  double slowest_rad_s = 10, fastest_rad_s = 0, fastest_m_s = 0, off_m = 0;
  Eigen::Vector3d before = at(arm.motion.position_rad()).translation();
  while (!arm.motion.done(second)) {
    REQUIRE_FALSE(arm.motion.step(kCycle_s, 1));
    const Eigen::Vector3d now = at(arm.motion.position_rad()).translation();
    const double speed_rad_s = arm.motion.velocity_rad_s().max_abs();
    if ((now - to.translation()).norm() > 0.05) slowest_rad_s = std::min(slowest_rad_s, speed_rad_s);
    fastest_rad_s = std::max(fastest_rad_s, speed_rad_s);
    fastest_m_s = std::max(fastest_m_s, (now - before).norm() / kCycle_s);
    before = now;
    const bool beyond = (now - corner.translation()).norm() > radius_m;
    if (tool_path && beyond) off_m = std::max(off_m, std::abs(now.x() - corner.translation().x()));
  }
  CHECK(slowest_rad_s > 0.03);  // no stop at the corner
  if (tool_path) CHECK(fastest_m_s < 0.1001);
  if (!tool_path) CHECK(fastest_rad_s < 0.3001);
  CHECK(off_m < 1e-3);
  CHECK((arm.motion.position_rad() - to_rad).max_abs() < 1e-6);
}

TEST_CASE("a path that nothing blends with goes to its end", "[ur]") {
  Arm arm;
  const JointVector target = arm.ahead(0.5);
  const auto ticket = arm.motion.movej(target, 0.5, 1, 0, {.radius_m = 0.05, .flange_T_tcp = Pose::Identity()});
  while (!arm.motion.done(ticket)) REQUIRE_FALSE(arm.motion.step(kCycle_s, 1));
  CHECK(arm.motion.busy());
  arm.run_until_rest();
  CHECK((arm.motion.position_rad() - target).max_abs() < 1e-12);
}

TEST_CASE("a line that leaves the reach is a fault, and the arm stands", "[ur]") {
  Arm arm;
  Pose to = forward(arm.model, arm.motion.position_rad()).flange().pose();
  to.translation().x() += 2;
  static_cast<void>(
      arm.motion.follow(ToolPath::line(forward(arm.model, arm.motion.position_rad()).flange().pose(), to), 1, 2, 0));
  std::optional<MotionFault> fault;
  for (int i = 0; i < 5000 && !fault; ++i) fault = arm.motion.step(kCycle_s, 1);
  REQUIRE(fault);
  CHECK_FALSE(arm.motion.busy());
  CHECK(arm.motion.standing());
}

TEST_CASE("the slider slows a path down without leaving it", "[ur]") {
  Arm arm;
  const JointVector from = arm.motion.position_rad(), target = arm.ahead(1);
  arm.slider = 0.5;
  arm.run(0.5);
  static_cast<void>(arm.motion.movej(target, 0.5, 1, 0));
  double off_path_rad = 0, time_s = 0;
  while (arm.motion.busy()) {
    if (time_s > 2) arm.slider = 0.25;
    REQUIRE_FALSE(arm.motion.step(kCycle_s, arm.slider));
    time_s += kCycle_s;
    const JointVector way = arm.motion.position_rad() - from;
    off_path_rad = std::max(off_path_rad, std::abs(way[4] + way[0] / 2));
  }
  CHECK(off_path_rad < 1e-12);
  CHECK(time_s > 5);
  CHECK(arm.motion.scale() == Approx(0.25));
}

TEST_CASE("a pause brakes on the path and a motion goes on from there", "[ur]") {
  Arm arm;
  const JointVector target = arm.ahead(1);
  static_cast<void>(arm.motion.movej(target, 1, 2, 0));
  arm.run(0.6);
  arm.motion.hold(true);
  arm.run(0.5);
  CHECK(arm.motion.standing());
  CHECK(arm.motion.busy());
  const JointVector held = arm.motion.position_rad();
  arm.run(5);
  CHECK((arm.motion.position_rad() - held).max_abs() == 0);
  arm.motion.hold(false);
  arm.run_until_rest();
  CHECK((arm.motion.position_rad() - target).max_abs() < 1e-12);
}

TEST_CASE("a stop brakes on the path and ends the motion", "[ur]") {
  Arm arm;
  const JointVector from = arm.motion.position_rad();
  static_cast<void>(arm.motion.movej(arm.ahead(1), 1, 2, 0));
  arm.run(0.7);
  const double speed_rad_s = arm.motion.velocity_rad_s().max_abs(), at_rad = arm.motion.position_rad()[0];
  static_cast<void>(arm.motion.stop(4));
  arm.run_until_rest();
  const JointVector way = arm.motion.position_rad() - from;
  CHECK(way[4] == Approx(-way[0] / 2));
  // Its own time slows down evenly, so the way is about that of an even deceleration.
  CHECK(arm.motion.position_rad()[0] - at_rad == Approx(speed_rad_s * speed_rad_s / 8).epsilon(0.1));
}

TEST_CASE("speedj accelerates to its speed, stopj ends it", "[ur]") {
  Arm arm;
  JointVector speed = JointVector::zero(6);
  speed[5] = 0.4;
  arm.motion.speedj(speed, 1);
  arm.run(0.2);
  CHECK(arm.motion.velocity_rad_s()[5] == Approx(0.2).margin(1e-9));
  arm.run(1);
  CHECK(arm.motion.velocity_rad_s()[5] == Approx(0.4).margin(1e-9));
  const auto ticket = arm.motion.stop(2);
  CHECK(arm.run_until_rest() == Approx(0.2).margin(0.005));
  CHECK(arm.motion.done(ticket));
}

TEST_CASE("servoj follows a moving target", "[ur]") {
  Arm arm;
  JointVector target = arm.motion.position_rad();
  for (int i = 0; i < 1000; ++i) {
    target[1] += 0.2 * kCycle_s;
    arm.motion.servoj(target, 0.03);
    REQUIRE_FALSE(arm.motion.step(kCycle_s, 1));
  }
  CHECK(target[1] - arm.motion.position_rad()[1] == Approx(0.2 * 0.03).margin(0.003));
  for (int i = 0; i < 1000; ++i) REQUIRE_FALSE(arm.motion.step(kCycle_s, 1));
  CHECK(arm.motion.position_rad()[1] == Approx(target[1]).margin(1e-6));
}

TEST_CASE("speedl moves the flange along its axis", "[ur]") {
  Arm arm;
  const Pose from = forward(arm.model, arm.motion.position_rad()).flange().pose();
  arm.motion.speedl({0, 0, 0.05, 0, 0, 0}, 1);
  arm.run(1);
  const Pose to = forward(arm.model, arm.motion.position_rad()).flange().pose();
  CHECK(to.translation().z() - from.translation().z() == Approx(0.05).margin(0.005));
  CHECK(to.translation().x() == Approx(from.translation().x()).margin(1e-3));
  CHECK((to.linear() - from.linear()).norm() < 0.01);
}

TEST_CASE("a joint that would leave its range is a fault", "[ur]") {
  Arm arm;
  JointVector at = arm.motion.position_rad();
  at[5] = 6.2;
  arm.motion.place(at);
  JointVector speed = JointVector::zero(6);
  speed[5] = 1;
  arm.motion.speedj(speed, 5);
  std::optional<MotionFault> fault;
  for (int i = 0; i < 500 && !fault; ++i) fault = arm.motion.step(kCycle_s, 1);
  CHECK(fault == MotionFault::kJointLimit);
  CHECK(arm.motion.position_rad()[5] <= 6.2832);
}

TEST_CASE("after a motion the structure swings as that of a cell's own arm, while it moves not at all", "[ur]") {
  Arm arm;
  arm.slider = GENERATE(1.0, 0.5);
  const JointVector from = arm.motion.position_rad(), target = arm.ahead(1);
  static_cast<void>(arm.motion.movej(target, 0.5, 1.4, 0));
  while (arm.motion.busy()) {
    REQUIRE_FALSE(arm.motion.step(kCycle_s, arm.slider));
    if (arm.motion.busy()) REQUIRE(arm.motion.true_position_rad() == arm.motion.position_rad());
  }
  sim::JointMotion own = sim::movej(Instant{}, from, target, 0.5 * arm.slider, 1.4 * arm.slider * arm.slider);
  const Instant end{seconds(own.duration_s()).ns};
  double largest_rad = 0;
  for (int i = 1; i < 300; ++i) {
    const JointVector swing = arm.motion.true_position_rad() - arm.motion.position_rad();
    const JointVector owns = own.true_position_rad(end + seconds(i * kCycle_s)) - target;
    CHECK((swing - owns).max_abs() < 8e-5);  // it ended within a cycle
    largest_rad = std::max(largest_rad, swing.max_abs());
    arm.run(kCycle_s);
  }
  CHECK(largest_rad > 1e-4);
  arm.run(2);
  CHECK(arm.motion.true_position_rad() == target);
}

TEST_CASE("an arm that brakes on its path swings by how hard it brakes", "[ur]") {
  Arm arm;
  static_cast<void>(arm.motion.movej(arm.ahead(2), 1, 1.4, 0));
  arm.run(1.2);
  static_cast<void>(arm.motion.stop(1.5));
  arm.run_until_rest();
  double largest_rad = 0;
  for (int i = 0; i < 100; ++i) {
    arm.run(kCycle_s);
    largest_rad = std::max(largest_rad, std::abs(arm.motion.true_position_rad()[0] - arm.motion.position_rad()[0]));
  }
  const sim::JointMotion braked = sim::movej(Instant{}, JointVector{0}, JointVector{2}, 1, 1.5);
  double owns_rad = 0;
  for (int i = 0; i < 100; ++i) {
    const Instant at{seconds(braked.duration_s() + i * kCycle_s).ns};
    owns_rad = std::max(owns_rad, std::abs(braked.true_position_rad(at)[0] - 2));
  }
  CHECK(largest_rad == Approx(owns_rad).epsilon(0.02));
}

TEST_CASE("a hand leads a standing arm, whatever the slider says, a program's motion is its own again", "[ur]") {
  Arm arm;
  arm.slider = 0.1;
  const JointVector target = arm.ahead(0.8);
  REQUIRE(arm.motion.lead(target, 0.8, 2));
  CHECK(arm.motion.in_hand());
  CHECK_FALSE(arm.motion.lead(arm.ahead(0), 0.8, 2));
  arm.motion.hold(true);  // the program is paused
  CHECK(arm.run_until_rest() == Approx(0.8 / 0.8 + 0.8 / 2).margin(0.003));
  CHECK((arm.motion.position_rad() - target).max_abs() < 1e-12);
  CHECK_FALSE(arm.motion.in_hand());
  CHECK(arm.motion.led());
  arm.slider = 1;
  arm.run(0.1);
  static_cast<void>(arm.motion.movej(arm.ahead(-0.5), 0.5, 1, 0));
  CHECK_FALSE(arm.motion.led());
  CHECK_FALSE(arm.motion.lead(target, 0.8, 2));
  CHECK(arm.run_until_rest() < 2);
}

}  // namespace firstlook
