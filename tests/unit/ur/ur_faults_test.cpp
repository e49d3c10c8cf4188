/// What a network, people, a loss of power and a controller's own faults do to a job, drawn from seeds: nothing moves
/// that was not asked for, or after it was stopped, and a job that ends early can say why. FIRSTLOOK_FAULT_SEEDS names
/// another number of seeds than 200, FIRSTLOOK_FAULT_FIRST another first one.
#include <algorithm>
#include <cstdlib>
#include <map>

#include "hal/sim/ur_controller/happenings.hpp"
#include "hal/ur/control_script.hpp"
#include "platform/core/random.hpp"
#include "tests/support/driven_ur.hpp"
#include "tests/support/sanitized_builds.hpp"

namespace firstlook {
namespace {

int number_of(const char* variable, int otherwise) {
  const char* const asked = std::getenv(variable);
  return asked != nullptr ? std::max(1, std::atoi(asked)) : otherwise;
}

using test::UrMemoryNetwork;

/// What a campaign has seen.
struct Tally {
  int moves = 0, presses = 0;
  std::map<std::string, int> endings;  ///< of jobs
};

/// Somebody who commands, somebody at the pendant, a bad network, and one who watches the true joints.
class Trial {
 public:
  Trial(std::uint64_t seed, Tally& tally)
      : tally_(tally),
        random_(seed, 5320),
        arm_(seed % 2 == 0 ? "ur5" : "ur5e"),
        steps_between_(60 * (1 + static_cast<int>(seed / 2 % 6))) {
    arm_.run(0.6);
    press_play();
  }

  void run() {
    for (int step = 0; step < kSteps; ++step) {
      if (random_.below(steps_between_) == 0) happen();
      command();
      arm_.run(0.01);
      watch();
    }
    // Left alone, all comes to rest.
    arm_.robot.stop(arm_.now());
    end();
    job_segments_ = 0;
    for (int step = 0; step < 300; ++step) arm_.run(0.01), watch();
  }

 private:
  static constexpr int kSegments = 4;  // of a job
  static constexpr int kSteps = 4000;  // of 10 ms, pauses aside

  /// The job as firstlook runs it: begun by a press of Play, segment by segment, over at the first stop.
  void command() {
    const std::size_t keys = arm_.keys.size();
    const bool pressed = keys > keys_seen_ && arm_.keys.back() == hal::OperatorAction::kPlay;
    keys_seen_ = keys;
    if (pressed && job_segments_ == 0) {
      job_segments_ = kSegments;
      ++tally_.presses;
    }
    if (job_segments_ == 0) return;
    if (const auto why = stopped()) {
      ++tally_.endings[*why];
      job_segments_ = 0;
      arm_.robot.stop(arm_.now());
      return end();
    }
    if (!arm_.last.program_running || arm_.last.moving || random_.below(10) != 0) return;
    if (--job_segments_ == 0) {
      ++tally_.endings["finished"];
      return;
    }
    hal::Segment segment{++number_, arm_.last.position_rad, 1.0, 1.4};
    segment.target_rad[0] = random_.uniform(-3, 3);
    if (const Status moved = arm_.robot.move(segment, arm_.now()); !moved) {
      ++tally_.endings["refused: " + std::string(fault_row(moved.error().fault).text)];
      job_segments_ = 0;
      return;
    }
    granted_ = true;
    ++tally_.moves;
  }

  /// Why a job that is under way cannot go on, as firstlook would say it.
  [[nodiscard]] std::optional<std::string> stopped() {
    if (arm_.now() - arm_.last.stamp > milliseconds(100)) return "link lost";
    if (arm_.last.safety == hal::ArmSafety::kEmergencyStop) return "emergency stop";
    if (arm_.last.safety == hal::ArmSafety::kFault) return "safety fault or violation";
    if (arm_.last.safety == hal::ArmSafety::kProtectiveStop) return "protective or safeguard stop";
    if (arm_.last.program_running) return std::nullopt;
    if (arm_.keys.back() == hal::OperatorAction::kStop) return "program ended at the pendant";
    if (arm_.keys.back() == hal::OperatorAction::kPause) return std::nullopt;  // a pause ends nothing
    return "program ended";
  }

  void happen() {
    const int what = random_.below(35);
    happened_ += fmt::format(" {}@{:.2f}", what, arm_.now().seconds());
    switch (what) {
      case 0:
        return happen("pause");
      case 1:
        return happen("stop");
      case 2:
        arm_.robot.stop(arm_.now());
        return end();
      case 3:
        arm_.network.plug(false);
        return end();
      case 4:
        arm_.network.break_control();
        return end();
      case 5:
        arm_.network.half_open();
        return end();
      case 6:
        arm_.network.stall(random_.uniform(0.02, 0.6));
        return;
      case 7:
      case 8:
        arm_.network.damage_next(static_cast<UrMemoryNetwork::Damage>(1 + random_.below(3)));
        return;
      case 9:
        return happen("protective-stop");
      case 10:
        static_cast<void>(arm_.ur.robot.controller().unlock_protective_stop());
        return;
      case 11:  // the controller loses its power; somebody switches it on again later
        arm_.network.break_control();
        arm_.network.plug(false);
        return happen("power-off");
      case 12:
        return pause_for_minutes();
      case 13:
        return happen("protective-stop-paused");
      case 14:
        return happen(random_.below(2) == 0 ? "emergency-stop" : "system-emergency-stop");
      case 15:
        return happen("open-safeguard");
      case 16:  // what played goes on by itself on the controller's side
        if (arm_.ur.state().safety_mode == sim::ur::SafetyMode::kSafeguardStop) happen("close-safeguard");
        return;
      case 17:
        return happen(random_.below(2) == 0 ? "safety-violation" : "safety-fault");
      case 18:  // switched off and on by its own menu, or by the mains: then nobody is told
        if (random_.below(2) == 0) arm_.network.half_open();
        return happen("reboot");
      case 19:
        return happen("power-off");
      case 20:
      case 21:
        arm_.ur.robot.controller().set_clock_forward(random_.below(2) == 0 ? random_.uniform(-5000, 5000)
                                                                           : random_.uniform(-1, 1));
        return;
      case 22:
        arm_.ur.robot.controller().set_speed_slider(random_.uniform(0.05, 1));
        return;
      case 23:
        return run_another_version();
      case 24:  // the controller hangs up on its clients, and its program does not
        arm_.network.break_sessions();
        return end();
      default:
        arm_.network.plug(true);
        make_ready();
        press_play();
    }
  }

  void happen(std::string_view words) {
    sim::ur::happen(*sim::ur::read_happening(words), arm_.ur.robot);
    end();
  }

  /// What a person at the pendant does before Play; some times not all of it.
  void make_ready() {
    sim::ur::Controller& controller = arm_.ur.robot.controller();
    if (controller.booting()) return;
    if (controller.state().emergency_stopped() && random_.below(4) != 0) controller.emergency_stop(false);
    static_cast<void>(controller.unlock_protective_stop());
    const sim::ur::SafetyMode safety = controller.state().safety_mode;
    if (safety == sim::ur::SafetyMode::kViolation || safety == sim::ur::SafetyMode::kFault) controller.restart_safety();
    if (controller.state().robot_mode != sim::ur::RobotMode::kRunning) controller.release_brakes();
  }

  /// A program of another firstlook, from a file on the pendant: it takes the place of what runs.
  void run_another_version() {
    if (!arm_.ur.robot.serves(sim::ur::Port::kSecondary)) return;
    std::string text = ur::control_script("firstlook", UrMemoryNetwork::kControlPort);
    const auto hello = [](int protocol) {
      return fmt::format("fl_say({}, {})", static_cast<int>(ur::ReportKind::kHello), protocol);
    };
    const std::string own = hello(ur::kControlProtocol);
    text.replace(text.find(own), own.size(), hello(ur::kControlProtocol + 1 + random_.below(90)));
    sim::ur::Session& port = arm_.ur.robot.open(sim::ur::Port::kSecondary);
    port.receive("def other():\n" + text + "\nend\n");
    arm_.ur.robot.close(port);
    end();
  }

  void pause_for_minutes() {
    happen("pause");
    for (const double until_s = arm_.now().seconds() + random_.uniform(60, 300); arm_.now().seconds() < until_s;) {
      arm_.run(0.05);
      watch();
    }
    press_play();
  }

  /// The program of a robot that was cut off while it was paused goes on until it finds that out: 0.2 s.
  void press_play() {
    if (!granted_ && arm_.ur.state().runtime == sim::ur::RuntimeState::kPaused) end();
    if (arm_.ur.robot.serves(sim::ur::Port::kDashboard)) sim::ur::press_play(arm_.ur.robot);
  }

  /// From here on what moves has to stand soon, until a new segment is asked for.
  void end() {
    granted_ = false;
    ended_ = arm_.now();
    crept_rad_ = 0;
  }

  void watch() {
    const double at_rad = arm_.ur.state().q_rad[0];
    const double moved_rad = std::abs(at_rad - seen_rad_);
    seen_rad_ = at_rad;
    // The program's own timeout, the answer to a stop that a slow network brings, and braking.
    constexpr double kSoon_s = 1.5;
    if (granted_ || (arm_.now() - ended_).seconds() < kSoon_s) return;
    crept_rad_ += moved_rad;
    INFO("at " << arm_.now().seconds() << " s, ended at " << ended_.seconds() << " s; cases:" << happened_);
    REQUIRE(crept_rad_ < 2e-3);  // the first cycle of a program that is resumed, some times
  }

  Tally& tally_;
  Random random_;
  test::DrivenUr arm_;
  int steps_between_;  ///< of 10 ms, from one mishap to the next, on average
  bool granted_ = false;
  Instant ended_{};
  double seen_rad_ = 0, crept_rad_ = 0;
  std::uint32_t number_ = 0;
  int job_segments_ = 0;  ///< that the job has left; 0: none is under way
  std::size_t keys_seen_ = 0;
  std::string happened_;
};

}  // namespace

TEST_CASE("whatever happens on the way, nothing moves after a stop without a fresh command of a program that plays",
          "[ur]") {
  const int seeds = number_of("FIRSTLOOK_FAULT_SEEDS", test::trials(200));
  const int first = number_of("FIRSTLOOK_FAULT_FIRST", 1);
  Tally tally;
  for (int seed = first; seed < first + seeds; ++seed) {
    INFO("seed " << seed);
    Trial trial(static_cast<std::uint64_t>(seed), tally);
    trial.run();
  }
  CHECK(tally.moves > 3 * seeds);
  if (std::getenv("FIRSTLOOK_FAULT_SEEDS") == nullptr) return;
  std::string endings;
  for (const auto& [why, count] : tally.endings) endings += fmt::format("\n  {:6} {}", count, why);
  WARN(seeds << " seeds, " << tally.presses << " jobs begun, " << tally.moves
             << " segments; jobs that ended:" << endings);
}

}  // namespace firstlook
