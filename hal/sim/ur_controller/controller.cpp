#include "hal/sim/ur_controller/controller.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "hal/sim/random_streams.hpp"
#include "platform/core/random.hpp"

namespace firstlook::sim::ur {
namespace {

// Clients take a controller whose clock is younger than 40 s for one that still boots.
constexpr double kStartedBefore_s = 60;
// Folded over the base, away from singularities and limits: where UR's own simulator starts, too.
const JointVector kStart_rad = {-1.6007, -1.7271, -2.203, -0.808, 1.5951, -0.031};

constexpr double kPowerOn_s = 1.0;
constexpr double kReleaseBrakes_s = 0.5;
constexpr double kInspect_s = 5;  // of a protective stop, before it can be unlocked
constexpr double kBoot_s = 10;    // real ones take about a minute

constexpr double kProgramStop_rad_s2 = 10;
constexpr double kProtectiveStop_rad_s2 = 20;
// The power is off and the brakes fall in: 0.70 rad of the shoulder at 180 deg/s are v² / 2 theta = 7 rad/s² (CB3
// manual, appendix A, category 0 stops). Rounded down.
constexpr double kBrakes_rad_s2 = 6;

Vector6 vector_of_joints(const JointVector& q) {
  Vector6 v{};
  for (int j = 0; j < 6; ++j) v[static_cast<std::size_t>(j)] = q[j];
  return v;
}

}  // namespace

Controller::Controller(const ControllerIdentity& identity)
    : identity_(identity), motion_(identity_.arm, kStart_rad), clock_s_(kStartedBefore_s) {
  state_.timestamp_s = clock_s_;
  report_arm();
}

void Controller::tell(ControllerEvent event) {
  event.timestamp_s = state_.timestamp_s;
  events_.add(std::move(event));
}

void Controller::set_safety(SafetyMode mode) {
  if (state_.safety_mode == mode) return;
  state_.safety_mode = mode;
  tell({.kind = ControllerEvent::Kind::kSafetyMode, .argument = static_cast<std::int32_t>(mode)});
}

void Controller::power_on() {
  const SafetyMode safety = state_.safety_mode;
  const bool broken = safety == SafetyMode::kViolation || safety == SafetyMode::kFault;
  if (state_.robot_mode != RobotMode::kPowerOff || state_.emergency_stopped() || broken) return;
  state_.robot_mode = RobotMode::kPowerOn;
  mode_until_ = state_.control_step + static_cast<std::uint64_t>(kPowerOn_s * identity_.frequency_hz());
}

void Controller::power_off() {
  if (booting()) return;
  stop();
  motion_.hold(false);
  static_cast<void>(motion_.stop(kBrakes_rad_s2));
  state_.robot_mode = RobotMode::kPowerOff;
  releasing_ = false;
  mode_until_ = 0;
  arm_reported_ = false;
}

void Controller::release_brakes() {
  power_on();
  if (state_.robot_mode != RobotMode::kPowerOn && state_.robot_mode != RobotMode::kIdle) return;
  if (releasing_) return;
  releasing_ = true;
  if (state_.robot_mode == RobotMode::kIdle) {
    mode_until_ = state_.control_step + static_cast<std::uint64_t>(kReleaseBrakes_s * identity_.frequency_hz());
  }
}

bool Controller::unlock_protective_stop() {
  if (state_.safety_mode != SafetyMode::kProtectiveStop) return true;
  const auto since = static_cast<double>(state_.control_step - protective_since_);
  if (since < kInspect_s * identity_.frequency_hz()) return false;
  set_safety(SafetyMode::kNormal);
  return true;
}

void Controller::restart_safety() {
  power_off();
  set_safety(emergency_);
}

void Controller::protective_stop(std::string_view reason, Program program) {
  if (state_.robot_mode != RobotMode::kRunning || state_.safety_mode == SafetyMode::kProtectiveStop) return;
  set_safety(SafetyMode::kProtectiveStop);
  protective_since_ = state_.control_step;
  tell({.kind = ControllerEvent::Kind::kErrorCode,
        .code = 153,
        .error = true,
        .text = fmt::format("Protective stop: {}", reason)});
  resume_after_safeguard_ = false;
  if (program == Program::kPauses) return pause();
  stop();
  static_cast<void>(motion_.stop(kProtectiveStop_rad_s2));
}

void Controller::emergency_stop(bool pressed, SafetyMode button) {
  emergency_ = pressed ? button : SafetyMode::kNormal;
  if (pressed) {
    set_safety(button);
    power_off();
  } else if (state_.emergency_stopped()) {
    set_safety(SafetyMode::kNormal);
  }
}

void Controller::safety_error(SafetyMode mode) {
  set_safety(mode);
  tell({.kind = ControllerEvent::Kind::kErrorCode,
        .code = 210,
        .error = true,
        .text = fmt::format("Safety system: {}", name_of(mode))});
  power_off();
}

void Controller::set_limits(SafetyMode mode) {
  const SafetyMode now = state_.safety_mode;
  if (now != SafetyMode::kNormal && now != SafetyMode::kReduced && now != SafetyMode::kRecovery) return;
  set_safety(mode);
  if (mode == SafetyMode::kRecovery) stop();
}

void Controller::reboot() {
  power_off();
  const ControllerState before = state_;
  state_ = {};
  watchdogs_.clear();
  state_.control_step = before.control_step;
  state_.safety_mode = emergency_;
  state_.runtime = RuntimeState::kStopped;
  state_.robot_mode = RobotMode::kBooting;
  motion_.hold(false);
  clock_s_ = 0;
  clock_from_ = state_.control_step;
  mode_until_ = state_.control_step + static_cast<std::uint64_t>(kBoot_s * identity_.frequency_hz());
  static_cast<void>(events_.take());
  arm_reported_ = false;
  report_arm();
}

double Controller::simulated_s() const {
  return kStartedBefore_s + static_cast<double>(state_.control_step) / identity_.frequency_hz();
}

void Controller::safeguard(bool open) {
  if (open && state_.safety_mode == SafetyMode::kNormal) {
    set_safety(SafetyMode::kSafeguardStop);
    resume_after_safeguard_ = state_.runtime == RuntimeState::kPlaying;
    pause();
  } else if (!open && state_.safety_mode == SafetyMode::kSafeguardStop) {
    set_safety(SafetyMode::kNormal);
    if (resume_after_safeguard_) play();
    resume_after_safeguard_ = false;
  }
}

void Controller::set_digital_input(int bit, bool value) {
  const std::uint64_t mask = std::uint64_t{1} << bit;
  state_.io.digital_inputs = value ? state_.io.digital_inputs | mask : state_.io.digital_inputs & ~mask;
}

bool Controller::can_play() const {
  const bool safe = state_.safety_mode == SafetyMode::kNormal || state_.safety_mode == SafetyMode::kReduced;
  return safe && state_.robot_mode == RobotMode::kRunning;
}

void Controller::play() {
  if (!can_play()) return;
  motion_.hold(false);
  const bool paused = state_.runtime == RuntimeState::kPausing || state_.runtime == RuntimeState::kPaused;
  state_.runtime = paused ? RuntimeState::kResuming : RuntimeState::kPlaying;
}

void Controller::pause() {
  if (state_.runtime != RuntimeState::kPlaying && state_.runtime != RuntimeState::kResuming) return;
  motion_.hold(true);
  state_.runtime = RuntimeState::kPausing;
}

void Controller::hold_by_popup() {
  held_by_popup_ = true;
  pause();
}

void Controller::close_popup() {
  if (std::exchange(held_by_popup_, false)) play();
}

PendantRequests::Id Controller::ask_operator(RequestedType type, const std::string& message) {
  const PendantRequests::Id id = requests_.ask(type);
  tell({.kind = ControllerEvent::Kind::kRequest,
        .code = static_cast<std::int32_t>(id),
        .argument = static_cast<std::int32_t>(type),
        .text = message});
  return id;
}

void Controller::stop() {
  resume_after_safeguard_ = false;
  held_by_popup_ = false;
  requests_.close_all();
  set_teach_mode(false);
  if (state_.runtime == RuntimeState::kStopped) return;
  state_.runtime = RuntimeState::kStopping;
  static_cast<void>(motion_.stop(kProgramStop_rad_s2));
}

void Controller::place(const JointVector& at_rad) {
  motion_.place(at_rad);
  arm_reported_ = false;
  report_arm();
}

void Controller::set_teach_mode(bool on) {
  if (on && !can_play()) return;
  if (state_.teach_mode && !on && motion_.in_hand()) static_cast<void>(motion_.stop(kProgramStop_rad_s2));
  state_.teach_mode = on;
}

bool Controller::lead(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2) {
  if (!can_play() || !to_rad.all_finite()) return false;
  return motion_.lead(to_rad, speed_rad_s, acceleration_rad_s2);
}

void Controller::set_encoders(double sigma_rad, std::uint64_t seed) {
  encoder_sigma_rad_ = sigma_rad;
  encoder_seed_ = seed;
}

/// Drawn for the cycle, not one after the other: who asks how often changes nothing.
Vector6 Controller::measured_q_rad() const {
  Vector6 measured = state_.q_rad;
  if (encoder_sigma_rad_ <= 0) return measured;
  Random noise(encoder_seed_ ^ mix64(state_.control_step), kEncoderStream);
  for (double& q : measured) q += encoder_sigma_rad_ * noise.normal();
  return measured;
}

Vector6 Controller::measured_tcp_pose() const {
  if (encoder_sigma_rad_ <= 0) return state_.tcp_pose;
  const Vector6 q = measured_q_rad();
  return vector_of(tcp_pose({q[0], q[1], q[2], q[3], q[4], q[5]}));
}

void Controller::set_speed_slider(double fraction) {
  if (std::isfinite(fraction)) state_.speed_slider = std::clamp(fraction, 0.0, 1.0);
}

void Controller::set_tcp_offset(const Vector6& flange_T_tcp) {
  state_.tcp_offset = flange_T_tcp;
  arm_reported_ = false;
}

Pose Controller::tcp_pose(const JointVector& q_rad) const {
  return forward(identity_.arm, q_rad).flange().pose() * flange_T_tcp();
}

void Controller::advance_modes() {
  if (mode_until_ == 0 || state_.control_step < mode_until_) return;
  mode_until_ = 0;
  if (state_.robot_mode == RobotMode::kBooting) {
    state_.robot_mode = RobotMode::kPowerOff;
  } else if (state_.robot_mode == RobotMode::kPowerOn) {
    state_.robot_mode = RobotMode::kIdle;
    if (releasing_) {
      mode_until_ = state_.control_step + static_cast<std::uint64_t>(kReleaseBrakes_s * identity_.frequency_hz());
    }
  } else if (state_.robot_mode == RobotMode::kIdle && releasing_) {
    releasing_ = false;
    state_.robot_mode = RobotMode::kRunning;
  }
}

void Controller::advance_runtime() {
  if (state_.runtime == RuntimeState::kStopping && !motion_.busy()) {
    state_.runtime = RuntimeState::kStopped;
  } else if (state_.runtime == RuntimeState::kPausing && motion_.standing()) {
    state_.runtime = RuntimeState::kPaused;
  } else if (state_.runtime == RuntimeState::kResuming) {
    state_.runtime = RuntimeState::kPlaying;
  }
}

void Controller::report_arm() {
  const bool moving = motion_.busy() || !motion_.standing();
  if (arm_reported_ && !moving) return;
  arm_reported_ = !moving;
  const JointVector& q = motion_.position_rad();
  const JointVector& qd = motion_.velocity_rad_s();
  state_.q_rad = vector_of_joints(q);
  state_.qd_rad_s = vector_of_joints(qd);
  state_.qdd_rad_s2 = vector_of_joints(motion_.acceleration_rad_s2());

  const LinkFrames frames = forward(identity_.arm, q);
  const Pose tcp = frames.flange().pose() * flange_T_tcp();
  state_.tcp_pose = vector_of(tcp);
  const Eigen::Vector3d elbow = frames.base_T_link[2].translation();
  Eigen::Vector3d speed = Eigen::Vector3d::Zero(), turn = speed, elbow_speed = speed;
  for (int j = 0; j < 6; ++j) {
    const Pose& link = frames.base_T_link[static_cast<std::size_t>(j)];
    const Eigen::Vector3d axis = link.linear().col(2) * qd[j];
    turn += axis;
    speed += axis.cross(tcp.translation() - link.translation());
    if (j < 2) elbow_speed += axis.cross(elbow - link.translation());
  }
  state_.tcp_speed = {speed.x(), speed.y(), speed.z(), turn.x(), turn.y(), turn.z()};
  state_.elbow_position_m = {elbow.x(), elbow.y(), elbow.z()};
  state_.elbow_velocity_m_s = {elbow_speed.x(), elbow_speed.y(), elbow_speed.z()};
}

void Controller::step() {
  ++state_.control_step;
  // Counted, not added up: a day later the clock is still exact.
  const auto cycles = static_cast<double>(state_.control_step - clock_from_);
  state_.timestamp_s = clock_s_ + cycles / identity_.frequency_hz();
  advance_modes();
  if (const auto fault = motion_.step(identity_.cycle.seconds(), state_.speed_slider)) protective_stop(name_of(*fault));
  state_.speed_scaling = state_.robot_mode == RobotMode::kRunning ? motion_.scale() : 0;
  advance_runtime();
  report_arm();
  state_.freedrive = motion_.in_hand() && !state_.teach_mode;
}

}  // namespace firstlook::sim::ur
