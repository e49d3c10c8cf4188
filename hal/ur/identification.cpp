#include "hal/ur/identification.hpp"

#include <algorithm>
#include <cmath>

#include "hal/ur/modes.hpp"

namespace firstlook::ur {
namespace {

template <std::size_t N>
void copy_text(std::string_view from, std::array<char, N>& to) {
  std::copy_n(from.begin(), std::min(from.size(), N - 1), to.begin());
}

}  // namespace

Identification::~Identification() {
  if (link_ != kNoLink) network_.close(link_);
}

bool Identification::complete() const {
  return version_ && state_.robot_mode && state_.safety_mode && state_.kinematics && state_.robot_type &&
         state_.tcp_offset;
}

Status Identification::read(const PrimaryPacket& packet) {
  if (const auto version = version_message(packet)) version_ = version;
  const auto state = primary_state(packet);
  if (!state) return std::unexpected(state.error());
  const auto keep = [](auto& to, const auto& from) {
    if (from) to = from;
  };
  keep(state_.robot_mode, state->robot_mode);
  keep(state_.safety_mode, state->safety_mode);
  keep(state_.kinematics, state->kinematics);
  keep(state_.robot_type, state->robot_type);
  keep(state_.tcp_offset, state->tcp_offset);
  return {};
}

std::optional<Result<RobotIdentity>> Identification::poll(Instant now) {
  if (!until_) {
    until_ = now + kWhole;
    link_ = network_.dial(Service::kPrimary);
  }
  if (!dashboard_ends_) {
    const Result<bool> answered = dashboard_.poll(now);
    dashboard_ends_ = !answered || *answered;
  }
  if (link_ == kNoLink) return Result<RobotIdentity>(failure(Fault::kDeviceMissing, "no connection is left"));
  connected_ = connected_ || network_.state(link_) == LinkState::kOpen;
  receive_into(inbox_, network_, link_);
  while (!complete()) {
    const auto packet = primary_cut(inbox_.view());
    if (!packet) return Result<RobotIdentity>(failure(Fault::kDeviceMissing, "{}", packet.error().detail()));
    if (!*packet) break;
    if (const Status status = read(**packet); !status) {
      return Result<RobotIdentity>(failure(Fault::kDeviceMissing, "{}", status.error().detail()));
    }
    inbox_.use_up((*packet)->bytes);
  }
  if (complete()) inbox_.clear();
  if (complete() && dashboard_ends_) {
    RobotIdentity robot;
    robot.version = *version_;
    robot.robot_type = *state_.robot_type;
    copy_text(arm_name_of(robot.robot_type, robot.version.major), robot.arm);
    copy_text(dashboard_.answer(DashboardClient::Question::kSerial), robot.serial);
    robot.kinematics = *state_.kinematics;
    robot.robot_mode = *state_.robot_mode;
    robot.safety_mode = *state_.safety_mode;
    robot.tcp_offset = *state_.tcp_offset;
    return Result<RobotIdentity>(robot);
  }
  const bool closed = network_.state(link_) == LinkState::kClosed;
  if (!complete() && (closed || now >= *until_)) {
    return Result<RobotIdentity>(
        failure(Fault::kDeviceMissing, "primary interface, port 30001: {}",
                !connected_ ? "nobody answers: is the controller switched on, and robot.host its address?"
                            : "the controller does not tell its version, model and kinematics"));
  }
  return std::nullopt;
}

Status check_robot(const RobotIdentity& robot, const ExpectedRobot& expected) {
  const ControllerVersion& v = robot.version;
  if (v.major < 3) {
    return failure(Fault::kDeviceMissing, "the controller's software is {}.{}: firstlook needs 3.0 or later", v.major,
                   v.minor);
  }
  if (robot.arm_name().empty()) {
    return failure(Fault::kConfigBadValue, "the controller moves a robot of type {} that firstlook does not know",
                   robot.robot_type);
  }
  if (robot.arm_name() != expected.arm) {
    return failure(Fault::kConfigBadValue, "arm.model is {}, the controller moves a {} (serial number {})",
                   expected.arm, robot.arm_name(), robot.serial_number());
  }
  if (robot.safety_mode != kSafetyNormal && robot.safety_mode != kSafetyReduced) {
    return failure(Fault::kProtectiveStop, "the controller is in {}: a person has to clear it at the pendant{}",
                   safety_mode_name(robot.safety_mode),
                   robot.safety_mode == kSafetyRecovery ? "; in recovery its joint limits are off" : "");
  }
  for (const KinematicsRow& row : robot.kinematics.rows) {
    for (const double value : {row.theta_rad, row.d_m, row.a_m, row.alpha_rad}) {
      if (!std::isfinite(value)) {
        return failure(Fault::kDeviceMissing, "the controller's kinematics are no numbers");
      }
    }
  }
  return {};
}

}  // namespace firstlook::ur
