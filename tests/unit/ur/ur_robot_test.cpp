/// The driver against the simulated controller, which runs our own program: in memory and in virtual time.
#include "hal/ur/ur_robot.hpp"

#include "hal/sim/ur_controller/happenings.hpp"
#include "hal/ur/control_script.hpp"
#include "tests/support/driven_ur.hpp"

namespace firstlook {
using hal::OperatorAction;
using ur::UrDelays;

namespace {

/// Plays, and is ready for a segment.
struct Playing {
  explicit Playing(const char* model = "ur5") : arm(model) {
    arm.run(0.6);
    arm.play();
    arm.run(0.5);
    start_rad = arm.last.position_rad;
    REQUIRE(arm.last.program_running);
  }
  hal::Segment segment(std::uint32_t number, double by_rad) const {
    hal::Segment s{number, start_rad, 1.0, 1.4};
    s.target_rad[0] += by_rad;
    return s;
  }
  void move(std::uint32_t number, double by_rad) {
    const Status moved = arm.robot.move(segment(number, by_rad), arm.now());
    INFO((moved ? std::string() : std::string(moved.error().detail())));
    REQUIRE(moved);
  }
  /// How far joint 1 turns in the next `s` seconds.
  double turned(double s) {
    const double before_rad = arm.ur.state().q_rad[0];
    arm.run(s);
    return std::abs(arm.ur.state().q_rad[0] - before_rad);
  }

  test::DrivenUr arm;
  JointVector start_rad;
};

constexpr double kStands_rad = 1e-9;
// The controller goes on by itself in the cycle in which the program, going on, reads that it shall stop.
constexpr double kFirstCycle_rad = 5e-4;

}  // namespace

TEST_CASE("Play, a segment, its end", "[ur]") {
  const std::string model = GENERATE("ur5", "ur5e", "ur10");
  Playing playing(model.c_str());
  test::DrivenUr& arm = playing.arm;
  CHECK(arm.keys == std::vector{OperatorAction::kPlay});
  CHECK(arm.robot.delays().consent_s > 0.002);  // the program is asked for, dials, says hello
  CHECK(arm.robot.delays().consent_s < 0.1);
  playing.move(1, 0.5);
  arm.run(0.3);
  CHECK(arm.last.moving);
  CHECK(arm.last.segment == 1);
  CHECK(arm.last.velocity_rad_s[0] > 0.1);
  arm.run(2);
  CHECK_FALSE(arm.last.moving);
  CHECK(arm.last.position_rad[0] == Approx(playing.start_rad[0] + 0.5).margin(1e-6));
  playing.move(2, 0);
  arm.run(2);
  CHECK(arm.last.segment == 2);
  CHECK(arm.last.position_rad[0] == Approx(playing.start_rad[0]).margin(1e-6));
  CHECK(arm.robot.delays().accept_s < 0.05);
  CHECK(arm.keys.size() == 1);
}

TEST_CASE("stamps are on our clock, and tell when the joints were there", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 0.5);
  Instant last{};
  for (int i = 0; i < 100; ++i) {
    arm.run(0.016);
    CHECK(arm.last.stamp <= arm.now());
    CHECK(arm.now() - arm.last.stamp < milliseconds(12));
    CHECK(arm.last.stamp > last);
    last = arm.last.stamp;
  }
}

TEST_CASE("stop in the middle of a move, and go on from there", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 2);
  arm.run(1);
  CHECK(arm.ur.state().qd_rad_s[0] > 0.9);
  arm.robot.stop(arm.now());
  arm.run(0.024);  // a cycle there, one to begin
  CHECK(arm.ur.state().qd_rad_s[0] < 0.99);
  arm.run(0.6);
  CHECK_FALSE(arm.last.moving);
  CHECK(arm.last.program_running);
  CHECK(playing.turned(1) < kStands_rad);
  CHECK(arm.robot.delays().stop_s < 0.5);
  playing.move(2, 0);
  arm.run(2);
  CHECK(arm.last.position_rad[0] == Approx(playing.start_rad[0]).margin(1e-6));
  CHECK(arm.keys == std::vector{OperatorAction::kPlay});
}

TEST_CASE("a pause withdraws the segment, after it nothing moves until it is asked to", "[ur]") {
  const double pause_s = GENERATE(0.3, 2.0, 120.0);
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 2);
  arm.run(1);
  REQUIRE(arm.ur.robot.programs().pause());
  arm.run(0.3);
  CHECK_FALSE(arm.last.program_running);
  CHECK_FALSE(arm.last.moving);
  CHECK(arm.keys.back() == OperatorAction::kPause);
  CHECK(arm.robot.move(playing.segment(2, 1), arm.now()).error().fault == Fault::kProgramStopped);
  arm.run(pause_s);
  CHECK(arm.network.unread_by_program() < 400);  // nothing piles up in its socket
  arm.play();
  CHECK(playing.turned(1) < kFirstCycle_rad);
  CHECK(arm.robot.delays().stop_s == 0);  // a pause is none
  CHECK(arm.last.program_running);
  CHECK_FALSE(arm.last.moving);
  CHECK(arm.keys.back() == OperatorAction::kPlay);
  playing.move(2, 1);
  arm.run(2);
  CHECK(arm.last.position_rad[0] == Approx(playing.start_rad[0] + 1).margin(1e-6));
}

TEST_CASE("Stop on the pendant ends the motion, and a new Play begins anew", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 2);
  arm.run(1);
  REQUIRE(arm.ur.robot.programs().stop());
  arm.run(0.5);
  CHECK_FALSE(arm.last.program_running);
  CHECK_FALSE(arm.last.moving);
  CHECK(arm.keys.back() == OperatorAction::kStop);
  CHECK(arm.robot.move(playing.segment(2, 1), arm.now()).error().fault == Fault::kProgramStopped);
  CHECK(playing.turned(2) < kStands_rad);
  CHECK(arm.network.links_open() == 1);  // RTDE alone
  arm.play();
  CHECK(playing.turned(1) < kStands_rad);
  CHECK(arm.last.program_running);
  playing.move(2, 0);
  arm.run(3);
  CHECK(arm.last.position_rad[0] == Approx(playing.start_rad[0]).margin(1e-6));
}

TEST_CASE("a cable that comes out stops the arm by the program's own read timeout", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 5);
  arm.run(1);
  arm.network.plug(false);
  const std::uint64_t reported = arm.reported;
  CHECK(arm.ur.state().qd_rad_s[0] > 0.9);
  arm.run(0.2);
  CHECK(arm.robot.move(playing.segment(2, 1), arm.now()).error().fault == Fault::kLinkLost);
  arm.run(0.4);
  CHECK(std::abs(arm.ur.state().qd_rad_s[0]) < kStands_rad);
  CHECK_FALSE(arm.ur.state().program_running());
  CHECK(arm.reported == reported);
  CHECK(playing.turned(3) < kStands_rad);
  arm.network.plug(true);
  CHECK(playing.turned(5) < kStands_rad);
  CHECK(arm.reported > reported);
  CHECK_FALSE(arm.last.program_running);
  CHECK(arm.robot.rtde().counters().connections == 2);
}

TEST_CASE("a connection to the program that ends while it plays is a lost link", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 5);
  arm.run(1);
  arm.network.break_control();
  arm.run(0.1);
  CHECK(arm.robot.move(playing.segment(2, 1), arm.now()).error().fault == Fault::kLinkLost);
  const bool silent = arm.now() - arm.last.stamp > milliseconds(30);
  CHECK((silent || !arm.last.program_running));
  arm.run(0.6);
  CHECK(std::abs(arm.ur.state().qd_rad_s[0]) < kStands_rad);
  CHECK(playing.turned(3) < kStands_rad);
}

TEST_CASE("a protective stop is reported, refuses motion, and is not unlocked", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 5);
  arm.run(1);
  arm.ur.robot.controller().protective_stop("a contact");
  arm.run(0.5);
  CHECK(arm.last.safety == hal::ArmSafety::kProtectiveStop);
  CHECK(arm.robot.move(playing.segment(2, 1), arm.now()).error().fault == Fault::kProtectiveStop);
  CHECK(playing.turned(20) < kStands_rad);
  CHECK(arm.last.safety == hal::ArmSafety::kProtectiveStop);
  CHECK_FALSE(arm.last.program_running);
}

TEST_CASE("an emergency stop and a safeguard stop end consent, a gate that closes does not give it back", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 5);
  arm.run(1);
  SECTION("emergency stop") {
    arm.ur.robot.controller().emergency_stop(true);
    arm.run(0.5);
    CHECK(arm.last.safety == hal::ArmSafety::kEmergencyStop);
    CHECK_FALSE(arm.last.program_running);
  }
  SECTION("safeguard") {
    arm.ur.robot.controller().safeguard(true);
    arm.run(0.5);
    CHECK(arm.last.safety == hal::ArmSafety::kProtectiveStop);
    CHECK_FALSE(arm.last.program_running);
    arm.ur.robot.controller().safeguard(false);
    CHECK(playing.turned(1) < kFirstCycle_rad);
  }
}

namespace {

/// As firstlook's machine does in the turn of the loop in which a report or its absence tells it: stop. Returns when it
/// did so first.
std::optional<Instant> obey(test::DrivenUr& arm, double s) {
  std::optional<Instant> stopped;
  for (const Instant until = arm.now() + seconds(s); arm.now() < until;) {
    arm.run(0.002);
    const bool lost = arm.now() - arm.last.stamp > milliseconds(100);
    if (!lost && arm.last.program_running && arm.last.safety == hal::ArmSafety::kNormal) continue;
    if (!stopped) stopped = arm.now();
    arm.robot.stop(arm.now());
  }
  return stopped;
}

/// One turn of the loop, and one report: a cycle of a CB3, four of an e-Series.
constexpr double kTurnAndReport_s = 0.002 + 0.008 + 1e-6;

}  // namespace

TEST_CASE("from whatever stops the controller to the command to stop: one turn of the loop and one report", "[ur]") {
  const std::string model = GENERATE("ur5", "ur5e");
  const std::string what = GENERATE("stop", "pause", "emergency-stop", "system-emergency-stop", "open-safeguard",
                                    "protective-stop", "protective-stop-paused", "safety-violation", "power-off");
  const double at_s = GENERATE(1.0, 1.002, 1.006);
  INFO(model << ": " << what << " at " << at_s);
  Playing playing(model.c_str());
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 5);
  CHECK_FALSE(obey(arm, at_s));
  CHECK_FALSE(arm.robot.delays().react_s);
  REQUIRE(arm.last.moving);
  const Instant happened = arm.now();
  happen(*sim::ur::read_happening(what), arm.ur.robot);
  const auto stopped = obey(arm, 0.05);
  REQUIRE(stopped);
  CHECK((*stopped - happened).seconds() <= kTurnAndReport_s);
  REQUIRE(arm.robot.delays().react_s);
  CHECK(*arm.robot.delays().react_s <= kTurnAndReport_s);
  CHECK_FALSE(arm.robot.delays().lost_s);
  static_cast<void>(obey(arm, 1));
  CHECK_FALSE(arm.last.moving);
  CHECK_FALSE(arm.last.program_running);
  CHECK(playing.turned(1) < kStands_rad);
}

TEST_CASE("a link that is lost is answered when it is closed, or after its silence", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 5);
  static_cast<void>(obey(arm, 1));
  SECTION("the cable is out") {
    arm.network.plug(false);
    static_cast<void>(obey(arm, 0.5));
    REQUIRE(arm.robot.delays().lost_s);
    CHECK(*arm.robot.delays().lost_s >= 0.1);
    CHECK(*arm.robot.delays().lost_s <= 0.1 + kTurnAndReport_s);
  }
  SECTION("the program's connection ends") {
    arm.network.break_control();
    static_cast<void>(obey(arm, 0.5));
    const UrDelays& delays = arm.robot.delays();
    REQUIRE((delays.react_s || delays.lost_s));
    CHECK(std::max(delays.react_s.value_or(0), delays.lost_s.value_or(0)) <= kTurnAndReport_s);
  }
  SECTION("RTDE alone is closed: the program is told to stop in the next turn") {
    const double before_rad_s = arm.ur.state().qd_rad_s[0];
    arm.network.break_sessions();
    static_cast<void>(obey(arm, 0.004 + 2 * 0.008));  // two turns, a cycle until it is read and one to begin
    REQUIRE(arm.robot.delays().lost_s);
    CHECK(*arm.robot.delays().lost_s <= kTurnAndReport_s);
    CHECK(arm.ur.state().qd_rad_s[0] < before_rad_s - 0.01);
    static_cast<void>(obey(arm, 0.5));
    CHECK(playing.turned(1) < kStands_rad);
    CHECK(arm.keys == std::vector{OperatorAction::kPlay});  // that it is there again is no press of Play
    return;
  }
  SECTION("the controller is switched off and on") {
    arm.ur.robot.reboot();
    const auto stopped = obey(arm, 0.5);
    REQUIRE(stopped);
    REQUIRE(arm.robot.delays().lost_s);
    CHECK(*arm.robot.delays().lost_s <= 0.1 + kTurnAndReport_s);
  }
  static_cast<void>(obey(arm, 1));
  CHECK(playing.turned(1) < kStands_rad);
  CHECK_FALSE(arm.robot.move(playing.segment(2, 1), arm.now()));
}

TEST_CASE("a controller that was switched off and on is met again, and moves after a fresh Play alone", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  playing.move(1, 2);
  arm.run(1);
  arm.ur.robot.reboot();
  CHECK(arm.ur.state().timestamp_s < 1e-9);
  CHECK(playing.turned(2) < 0.09);  // without power it brakes: from 1 rad/s at 6 rad/s^2
  CHECK(playing.turned(10) < kStands_rad);
  arm.run(10);
  CHECK(arm.robot.rtde().streaming());
  CHECK(arm.now() - arm.last.stamp < milliseconds(20));  // its clock began anew, ours did not
  CHECK_FALSE(arm.last.program_running);
  CHECK(arm.ur.dashboard("play") == "Failed to execute: play");  // no power
  CHECK(arm.ur.dashboard("brake release") == "Brake releasing");
  arm.run(3);
  CHECK(arm.ur.dashboard("load external_control.urp").starts_with("Loading program"));
  arm.play();
  CHECK(playing.turned(1) < kStands_rad);
  CHECK(arm.last.program_running);
  playing.move(2, 0);
  arm.run(3);
  CHECK(arm.last.position_rad[0] == Approx(playing.start_rad[0]).margin(1e-6));
}

TEST_CASE("a controller's clock that is set does not carry stamps away", "[ur]") {
  const double by_s = GENERATE(3600.0, -3600.0, 1.0, -1.0, 0.3, -0.3);
  INFO(by_s);
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  arm.ur.robot.controller().set_clock_forward(by_s);
  arm.run(0.1);
  CHECK(arm.last.stamp <= arm.now());
  arm.run(12);
  CHECK(arm.last.stamp <= arm.now());
  CHECK(arm.now() - arm.last.stamp < milliseconds(12));
}

TEST_CASE("a command that is cut or changed on the way moves nothing and ends the program", "[ur]") {
  using Damage = test::UrMemoryNetwork::Damage;
  const Damage damage = GENERATE(Damage::kCut, Damage::kChanged);
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  arm.network.damage_next(damage);
  playing.move(1, 1);
  CHECK(playing.turned(2) < kStands_rad);
  CHECK_FALSE(arm.ur.state().program_running());
  CHECK_FALSE(arm.last.program_running);
}

TEST_CASE("the slider slows the arm and nothing else", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  arm.ur.robot.controller().set_speed_slider(0.2);
  playing.move(1, 0.5);
  arm.run(1);
  CHECK(arm.last.moving);
  CHECK(arm.last.velocity_rad_s[0] < 0.21);
  arm.run(7);
  CHECK_FALSE(arm.last.moving);
  CHECK(arm.last.position_rad[0] == Approx(playing.start_rad[0] + 0.5).margin(1e-6));
}

TEST_CASE("lines for the pendant reach its log", "[ur]") {
  Playing playing;
  test::DrivenUr& arm = playing.arm;
  sim::ur::Session& log = arm.ur.robot.open(sim::ur::Port::kPrimary);
  arm.robot.pendant().show("looking for the board");
  arm.run(0.2);
  CHECK(log.output().find("firstlook: looking for the board") != std::string::npos);
}

namespace {
struct Heard final : ur::NoticeSink {
  void notice(std::string_view line) override { lines.emplace_back(line); }
  std::vector<std::string> lines;
};
}  // namespace

TEST_CASE("a program of another version is refused, and tells the person at the pendant", "[ur]") {
  Heard heard;
  test::DrivenUr arm("ur5", &heard);
  std::string old = ur::control_script("firstlook", test::UrMemoryNetwork::kControlPort);
  const std::string hello =
      fmt::format("fl_say({}, {})", static_cast<int>(ur::ReportKind::kHello), ur::kControlProtocol);
  REQUIRE(old.find(hello) != std::string::npos);
  old.replace(old.find(hello), hello.size(), fmt::format("fl_say({}, 99)", static_cast<int>(ur::ReportKind::kHello)));
  sim::ur::Session& pendant = arm.ur.robot.open(sim::ur::Port::kPrimary);
  arm.run(0.6);
  pendant.receive("def old():\n" + old + "\nend\n");
  arm.run(1);
  CHECK_FALSE(arm.last.program_running);
  CHECK(arm.keys.empty());
  CHECK(pendant.output().find("not of the firstlook") != std::string::npos);
  REQUIRE(heard.lines.size() == 1);
  CHECK(heard.lines[0].find("protocol 99") != std::string::npos);
}

TEST_CASE("the plain script does the same without the URCap", "[ur]") {
  test::DrivenUr arm("ur5e");
  arm.run(0.6);
  sim::ur::Session& port = arm.ur.robot.open(sim::ur::Port::kSecondary);
  port.receive("def cart():\n" + ur::control_script("firstlook", test::UrMemoryNetwork::kControlPort) + "\nend\n");
  arm.run(0.5);
  CHECK(arm.last.program_running);
  CHECK(arm.keys == std::vector{OperatorAction::kPlay});
}

TEST_CASE("a program that loops forever does not begin again by itself", "[ur]") {
  test::DrivenUr arm("ur5");
  arm.run(0.6);
  sim::ur::Session& port = arm.ur.robot.open(sim::ur::Port::kSecondary);
  port.receive("def cart():\nwhile True:\n" + ur::control_script("firstlook", test::UrMemoryNetwork::kControlPort) +
               "\nend\nend\n");
  arm.run(0.5);
  REQUIRE(arm.last.program_running);
  arm.network.break_control();
  arm.run(3);
  CHECK_FALSE(arm.ur.state().program_running());
  CHECK(arm.robot.program().programs() == 1);
}

TEST_CASE("Play within the self test is answered after it", "[ur]") {
  test::DrivenUr arm("ur5");
  arm.run(0.05);
  arm.play();
  arm.run(0.3);
  CHECK(arm.keys.empty());
  arm.run(0.5);
  CHECK(arm.keys == std::vector{OperatorAction::kPlay});
}

}  // namespace firstlook
