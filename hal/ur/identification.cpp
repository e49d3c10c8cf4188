#include "hal/ur/identification.hpp"

#include <algorithm>
#include <cmath>
#include <span>

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
    robot.remote_control = dashboard_.answer(DashboardClient::Question::kRemote) == "true";
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

namespace {

/// A rotation vector as a quaternion's vector and scalar part.
std::array<double, 4> quaternion_of(std::span<const double, 3> turn_rad) {
  const double angle = std::hypot(turn_rad[0], turn_rad[1], turn_rad[2]);
  const double scale = angle > 1e-12 ? std::sin(angle / 2) / angle : 0.5;
  return {scale * turn_rad[0], scale * turn_rad[1], scale * turn_rad[2], std::cos(angle / 2)};
}

double angle_between(std::span<const double, 3> one_rad, std::span<const double, 3> other_rad) {
  const auto a = quaternion_of(one_rad), b = quaternion_of(other_rad);
  double dot = 0;
  for (std::size_t i = 0; i < 4; ++i) dot += a[i] * b[i];
  return 2 * std::acos(std::min(1.0, std::abs(dot)));
}

Status check_tcp(const std::array<double, 6>& set, const std::array<double, 6>& expected) {
  // Half of the last digit that the pendant shows, some times over.
  constexpr double kSame_m = 1e-4, kSame_rad = 1e-3;
  const std::span<const double, 6> one(set), other(expected);
  const double off_m = std::hypot(set[0] - expected[0], set[1] - expected[1], set[2] - expected[2]);
  const double off_rad = angle_between(one.subspan<3, 3>(), other.subspan<3, 3>());
  if (off_m <= kSame_m && off_rad <= kSame_rad) return {};
  return failure(
      Fault::kConfigBadValue,
      "robot.tcp_offset: the controller's TCP is [{:.4f}, {:.4f}, {:.4f}, {:.3f}, {:.3f}, {:.3f}], {:.1f} mm "
      "and {:.3f} rad off: set it in Installation, TCP, or correct the configuration",
      set[0], set[1], set[2], set[3], set[4], set[5], 1e3 * off_m, off_rad);
}

}  // namespace

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
  if (expected.pendant_starts && robot.remote_control) {
    return failure(
        Fault::kConfigBadValue,
        "the robot is in remote control, where Play is pressed by the network and by no person: switch it to "
        "local control on the pendant, or set start_source: panel");
  }
  if (expected.tcp_offset) return check_tcp(robot.tcp_offset, *expected.tcp_offset);
  return {};
}

}  // namespace firstlook::ur
