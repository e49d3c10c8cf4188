#include "hal/ur/ur_robot.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hal/ur/control_script.hpp"

namespace firstlook::ur {
namespace {

// At rest a real arm's reported velocities scatter by some mrad/s.
constexpr double kStanding_rad_s = 0.01;
// Two connections may overtake each other by a report; the second one after the program's word is later than it.
constexpr int kStandingReports = 2;
constexpr Duration kStayEvery = milliseconds(6);  // with reports at 125 Hz: at each of them
constexpr double kSegmentMax = 100;  // rad, rad/s, rad/s²: far beyond every arm, and whole micro units fit 32 bits

hal::ArmSafety safety_of(int mode) {
  switch (mode) {
    case kSafetyNormal:
      return hal::ArmSafety::kNormal;
    case kSafetyReduced:
      return hal::ArmSafety::kReduced;
    case kSafetyRecovery:
      return hal::ArmSafety::kRecovery;
    case kSafetySystemEmergencyStop:
    case kSafetyRobotEmergencyStop:
      return hal::ArmSafety::kEmergencyStop;
    case kSafetyViolation:
    case kSafetyFault:
      return hal::ArmSafety::kFault;
    default:
      // A safeguard stop among them: the controller would go on by itself when the gate closes, firstlook does not.
      return hal::ArmSafety::kProtectiveStop;
  }
}

bool may_move(hal::ArmSafety safety) { return safety == hal::ArmSafety::kNormal || safety == hal::ArmSafety::kReduced; }

Status check(const hal::Segment& segment) {
  if (segment.target_rad.size() != 6 || !segment.target_rad.all_finite() ||
      segment.target_rad.max_abs() > 2 * M_PI + 1e-6) {
    return failure(Fault::kMoveRefused, "segment {}: target is not 6 joint angles within ±360 degrees", segment.number);
  }
  const auto usable = [](double value) { return value > 0 && value < kSegmentMax; };
  if (!usable(segment.speed_rad_s) || !usable(segment.acceleration_rad_s2)) {
    return failure(Fault::kMoveRefused, "segment {}: speed {} rad/s or acceleration {} rad/s2 out of range",
                   segment.number, segment.speed_rad_s, segment.acceleration_rad_s2);
  }
  if (segment.number == 0 || segment.number > static_cast<std::uint32_t>(kNumberMax)) {
    return failure(Fault::kMoveRefused, "segment {}: numbers count up from 1, to 1e9", segment.number);
  }
  return {};
}

}  // namespace

UrRobot::UrRobot(Network& network, const UrRobotOptions& options, NoticeSink* notices)
    : notices_(notices),
      rtde_(network, kReports_hz),
      program_(network, control_script(options.own_host, options.control_port), notices),
      pendant_(*this) {
  std::copy_n(options.model.begin(), std::min(options.model.size(), model_.size() - 1), model_.begin());
}

void UrRobot::tell(std::string_view line) {
  if (notices_ != nullptr) notices_->notice(line);
}

void UrRobot::press(hal::OperatorAction action, Instant now) {
  if (keys_.full()) static_cast<void>(keys_.pop());
  keys_.push({now, action});
}

bool UrRobot::playing() const { return report_.runtime == Runtime::kPlaying; }

bool UrRobot::consent() const {
  return program_.up() && playing() && !withdrawn_ && report_.robot_mode == kRobotModeRunning &&
         may_move(safety_of(report_.safety_mode));
}

// ---- the program

void UrRobot::hear_program(Instant now) {
  if (!opens_ || now < *opens_) return;
  const std::uint64_t before = program_.programs();
  program_.poll(now);
  if (program_.programs() != before) {
    // A request without a program soon after was another one's.
    constexpr Duration kSoon = milliseconds(5000);
    const auto& asked = program_.asked();
    played_ = asked && now - *asked < kSoon ? *asked : now;
    moved_ = false;
    was_up_ = true;
    flight_ = Flight::kNone;
    withdrawn_ = cut_short_ = false;
    cut_.reset();
    cause_.reset();
  }
  while (const auto report = program_.take()) {
    switch (report->kind) {
      case ReportKind::kAccepted:
        if (flight_ != Flight::kSent || static_cast<std::uint32_t>(report->number) != number_) break;
        flight_ = Flight::kMoving;
        accepted_ = number_;
        delays_.accept_s = std::max(delays_.accept_s, (now - sent_).seconds());
        if (!std::exchange(moved_, true)) delays_.motion_s = std::max(delays_.motion_s, (now - played_).seconds());
        break;
      case ReportKind::kDone:
        if (flight_ != Flight::kMoving || static_cast<std::uint32_t>(report->number) != number_) break;
        flight_ = Flight::kArriving;
        standing_reports_ = 0;
        break;
      case ReportKind::kStopped:
        if (report->number != stop_number_) break;
        // One that was sent in a pause waited for the program to go on: that is no delay.
        if (flight_ == Flight::kStopping && !withdrawn_) {
          delays_.stop_s = std::max(delays_.stop_s, (now - sent_).seconds());
        }
        withdrawn_ = false;
        if (flight_ != Flight::kStopping) break;
        flight_ = Flight::kArriving;
        standing_reports_ = 0;
        break;
      default:
        tell("the robot's program says what firstlook does not know: closed");
        program_.close();
    }
  }
}

void UrRobot::note_end_of_program(Instant now) {
  if (!was_up_ || program_.up()) return;
  was_up_ = false;
  cut_short_ = flight_ == Flight::kSent || flight_ == Flight::kMoving;
  if (flight_ != Flight::kNone) flight_ = Flight::kArriving;
  standing_reports_ = 0;
  cut_ = now;
}

void UrRobot::follow_program(Instant now) {
  if (!program_.up()) return;
  if (flight_ != Flight::kNone && flight_ != Flight::kArriving && flight_ != Flight::kStopping && lost(now)) {
    command_stop(now);
  }
  // A program that does not answer is one that nobody commands: without us it stops the arm and ends.
  const bool mute = (flight_ == Flight::kSent && now - sent_ > kAccept) ||
                    (flight_ == Flight::kStopping && now - sent_ > kStopAnswer);
  if (playing() && mute) {
    tell("the robot's program does not answer: closed");
    program_.close();
  }
}

void UrRobot::stay(Instant now) {
  const bool listens = playing() || report_.runtime == Runtime::kResuming;
  // Nothing until a stop is answered: one that got lost lets the program run into its own timeout.
  if (!program_.up() || !listens || flight_ == Flight::kStopping || now - stayed_ < kStayEvery) return;
  stayed_ = now;
  program_.send(plain_command(CommandKind::kStay, 0));
}

/// A segment under way that the controller's own state ends.
void UrRobot::note_cause(const RtdeReport& report, Instant stamp) {
  const bool under_way = flight_ == Flight::kSent || flight_ == Flight::kMoving || cut_short_;
  const bool ended = report.runtime != Runtime::kPlaying || report.robot_mode != kRobotModeRunning ||
                     !may_move(safety_of(report.safety_mode));
  if (!under_way || !ended) {
    if (!ended) cause_.reset();
  } else if (!cause_) {
    cause_ = stamp;
  }
}

void UrRobot::note_withdrawal(Instant now) {
  const auto keep = [now](std::optional<double>& longest, Instant since) {
    longest = std::max(longest.value_or(0), (now - since).seconds());
  };
  if (cause_) keep(delays_.react_s, *cause_);
  const bool under_way = flight_ == Flight::kSent || flight_ == Flight::kMoving;
  if (!cause_ && cut_short_ && cut_) keep(delays_.lost_s, *cut_);
  if (!cause_ && under_way && heard_ && lost(now)) keep(delays_.lost_s, *heard_);
  cause_.reset();
  cut_short_ = false;
}

void UrRobot::command_stop(Instant now) {
  note_withdrawal(now);
  if (program_.send(plain_command(CommandKind::kStop, ++stop_number_))) {
    flight_ = Flight::kStopping;
    sent_ = now;
  }
}

// ---- the controller's reports

void UrRobot::follow_runtime(Runtime before, Runtime after, Instant now) {
  const auto is_pause = [](Runtime r) { return r == Runtime::kPausing || r == Runtime::kPaused; };
  const auto is_end = [](Runtime r) { return r == Runtime::kStopping || r == Runtime::kStopped; };
  if (is_pause(after) && !is_pause(before) && program_.up()) {
    // The command waits in the program's socket: the first that it does when it goes on is to stop.
    withdrawn_ = true;
    command_stop(now);
    press(hal::OperatorAction::kPause, now);
  }
  if (after == Runtime::kPlaying && before != Runtime::kPlaying) sent_ = now;  // from now on it can answer
  if (is_end(after) && !is_end(before)) {
    if (program_.up() || cut_) press(hal::OperatorAction::kStop, now);
    program_.close();
    was_up_ = false;
    withdrawn_ = false;
    if (flight_ != Flight::kNone) flight_ = Flight::kArriving;
    standing_reports_ = 0;
  }
  if (is_end(after)) cut_.reset();
}

void UrRobot::follow(const RtdeReport& report, Instant now) {
  const Runtime before = report_.runtime;
  report_ = report;
  heard_ = now;
  if (!opens_) opens_ = now + kSelfTest;
  stamp_ = clock_.to_ours(report.timestamp_s, now);
  note_cause(report, stamp_);
  follow_runtime(before, report.runtime, now);
  const bool stands = report.velocity_rad_s.max_abs() < kStanding_rad_s;
  if (flight_ == Flight::kArriving && ++standing_reports_ >= kStandingReports && stands) flight_ = Flight::kNone;
  if (consent() && !consented_) {
    if (!moved_) delays_.consent_s = std::max(delays_.consent_s, (now - played_).seconds());
    press(hal::OperatorAction::kPlay, now);
  }
  consented_ = consent();
  stay(now);
}

hal::ArmState UrRobot::state_of(const RtdeReport& report) const {
  hal::ArmState state;
  state.stamp = stamp_;
  state.position_rad = report.position_rad;
  state.velocity_rad_s = report.velocity_rad_s;
  state.safety = safety_of(report.safety_mode);
  state.program_running = consented_;
  // While the program is paused it cannot say that the arm stands.
  state.moving = withdrawn_ ? report.velocity_rad_s.max_abs() >= kStanding_rad_s : flight_ != Flight::kNone;
  state.segment = accepted_;
  return state;
}

std::optional<hal::ArmState> UrRobot::poll(Instant now) {
  // Asked again in the same turn, whether more reports have come, it does not ask the program's side once more.
  if (now != polled_ || !heard_) {
    hear_program(now);
    note_end_of_program(now);
  }
  polled_ = now;
  const bool was_streaming = rtde_.streaming();
  const auto report = rtde_.poll(now);
  if (was_streaming && !rtde_.streaming() && rtde_.trouble()) tell(rtde_.trouble()->detail());
  if (report) follow(*report, now);
  follow_program(now);
  if (!report) return std::nullopt;
  // A program that plays and hears nothing from us: the same as if nothing came from the robot.
  if (cut_ && playing() && now - *cut_ > kProgramEnd) return std::nullopt;
  ++counters_.states;
  return state_of(*report);
}

/// Without a program on the robot all that is awaited is a report every 8 ms; a program that knocks can wait so long.
Instant UrRobot::next_due() const {
  const Instant soon = polled_ + kPoll;
  return rtde_.streaming() && heard_ && !program_.up() ? std::max(soon, *heard_ + kPause) : soon;
}

// ---- hal::RobotArm

Status UrRobot::move(const hal::Segment& segment, Instant now) {
  const auto refuse = [&](Status status) {
    ++counters_.refused;
    return status;
  };
  if (stale(now) || cut_) {
    return refuse(failure(Fault::kLinkLost, "segment {}: {}", segment.number,
                          cut_ ? "the connection to the robot's program ended" : "no joints from the controller"));
  }
  if (const hal::ArmSafety safety = safety_of(report_.safety_mode); !may_move(safety)) {
    return refuse(failure(Fault::kProtectiveStop, "segment {}: the controller is in {}", segment.number,
                          safety_mode_name(report_.safety_mode)));
  }
  if (!consent()) return refuse(failure(Fault::kProgramStopped, "segment {}: no program runs", segment.number));
  if (flight_ != Flight::kNone) {
    return refuse(failure(Fault::kProgramStopped, "segment {}: segment {} is still running", segment.number, number_));
  }
  if (Status status = check(segment); !status) return refuse(status);
  if (!program_.send(move_command(segment))) {
    return refuse(failure(Fault::kLinkLost, "segment {}: the robot's program is gone", segment.number));
  }
  flight_ = Flight::kSent;
  number_ = segment.number;
  sent_ = stayed_ = now;
  ++counters_.segments;
  return {};
}

void UrRobot::stop(Instant now) {
  ++counters_.stops;
  note_withdrawal(now);
  const bool stands = report_.velocity_rad_s.max_abs() < kStanding_rad_s;
  if (flight_ == Flight::kStopping || (flight_ == Flight::kNone && stands)) return;
  command_stop(now);
}

// ---- hal::Pendant

std::optional<hal::OperatorEvent> UrRobot::UrPendant::poll(Instant now) {
  if (robot_.keys_.empty()) return std::nullopt;
  hal::OperatorEvent event = robot_.keys_.pop();
  event.stamp = std::min(event.stamp, now);
  return event;
}

Instant UrRobot::UrPendant::next_due() const { return robot_.keys_.empty() ? robot_.next_due() : robot_.polled_; }

}  // namespace firstlook::ur
