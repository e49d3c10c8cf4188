#include "app/wiring/network_arm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "hal/ur/modes.hpp"

namespace firstlook {

Status refuse_other_arms(const Config& config) {
  if (config.arm.file == "none") return {};
  return failure(Fault::kConfigBadValue,
                 "arm.file: {} and robot.host: {} do not go together: a robot on the network is one of arm.model, and "
                 "tells its kinematics itself",
                 config.arm.file, config.robot.host);
}

/// What the robot's side has to say, among the lines of the job.
class NetworkArm::Notices final : public ur::NoticeSink {
 public:
  explicit Notices(Narrator& narrator) : narrator_(narrator) {}
  void notice(std::string_view line) override {
    std::array<char, 256> text;
    const auto end = fmt::format_to_n(text.data(), text.size(), "robot     {}", line);
    narrator_.line({text.data(), std::min(end.size, text.size())});
  }

 private:
  Narrator& narrator_;
};

NetworkArm::NetworkArm() = default;
NetworkArm::~NetworkArm() = default;

Result<std::unique_ptr<NetworkArm>> NetworkArm::connect(const Config& config, Narrator& narrator) {
  std::unique_ptr<NetworkArm> arm(new NetworkArm);
  arm->notices_ = std::make_unique<Notices>(narrator);
  ur::NetworkRobotOptions options;
  options.network = {config.robot.host, config.robot.port_offset, static_cast<std::uint16_t>(config.robot.program_port),
                     static_cast<std::uint16_t>(config.robot.control_port)};
  options.own_address = config.robot.own_address;
  options.arm = config.arm.model;
  options.payload_kg = config.robot.payload_kg;
  arm->host_ = config.robot.host;
  auto connected = ur::NetworkRobot::connect(options, arm->notices_.get());
  if (!connected) return std::unexpected(connected.error());
  arm->robot_ = std::move(*connected);
  const ur::RobotIdentity& identity = arm->robot_->identity();
  auto measured = measure(identity, config);
  if (!measured) return std::unexpected(measured.error());
  arm->measured_ = *measured;
  narrator.line(fmt::format("robot     {} at {}, serial number {}, kinematics as its factory measured them",
                            config.arm.model, config.robot.host, identity.serial_number()));
  if (const auto& near = arm->measured_.near) {
    narrator.line(fmt::format(
        "robot     its frames lie far from the links: taken nearer, the flange is off by {:.2f} mm, {:.2f} mrad RMS",
        1e3 * near->rms_m, 1e3 * near->rms_rad));
  }
  return arm;
}

Result<NetworkArm::MeasuredArm> NetworkArm::measure(const ur::RobotIdentity& robot, const Config& config) {
  constexpr double kNear_m = 0.02, kNear_rad = 0.05;           // ten times what a factory corrects
  constexpr double kFitWorst_m = 0.005, kFitWorst_rad = 0.01;  // another arm
  MeasuredArm arm{find_arm_model(config.arm.model).value(), {}};
  const std::array<DhRow, kJointsMax> published = arm.model.dh;
  bool near = true;
  for (std::size_t j = 0; j < robot.kinematics.rows.size(); ++j) {
    const ur::KinematicsRow& row = robot.kinematics.rows[j];
    arm.model.dh[j] = {row.theta_rad, row.d_m, row.a_m, row.alpha_rad};
    near = near && std::abs(row.d_m - published[j].d_m) < kNear_m && std::abs(row.a_m - published[j].a_m) < kNear_m &&
           std::abs(row.theta_rad - published[j].theta_offset_rad) < kNear_rad &&
           std::abs(row.alpha_rad - published[j].alpha_rad) < kNear_rad;
  }
  if (near) return arm;
  arm.near = near_dh(find_arm_model(config.arm.model).value(), arm.model.dh);
  arm.model.dh = arm.near->dh;
  if (arm.near->worst_m > kFitWorst_m || arm.near->worst_rad > kFitWorst_rad) {
    return failure(
        Fault::kConfigBadValue,
        "robot at {}: its kinematics are not those of a {}: the flange would be off by {:.1f} mm, {:.1f} mrad",
        config.robot.host, arm.model.name, 1e3 * arm.near->worst_m, 1e3 * arm.near->worst_rad);
  }
  return arm;
}

hal::DeviceReport NetworkArm::report(Instant) const {
  const ur::RobotIdentity& robot = robot_->identity();
  const ur::RtdeClient& rtde = robot_->robot().rtde();
  hal::DeviceReport report;
  report.state = rtde.streaming() ? hal::DeviceState::kReady : hal::DeviceState::kStarting;
  report.device.set("{} at {}", robot.arm_name(), host_);
  report.detail.set("software {}.{}.{}, serial number {}, factory kinematics {:08x}, {}", robot.version.major,
                    robot.version.minor, robot.version.bugfix, robot.serial_number(), robot.kinematics.checksums[0],
                    ur::robot_mode_name(robot.robot_mode));
  if (robot.robot_mode != ur::kRobotModeRunning) {
    report.state = hal::DeviceState::kUnsuitable;
    report.remedy.set("Switch the robot on at the pendant and release its brakes: firstlook never does that.");
  } else if (rtde.trouble()) {
    report.state = hal::DeviceState::kLost;
    report.detail.set("{}", rtde.trouble()->detail());
    report.remedy.set("Check the cable, and that RTDE is enabled (Settings, Security, Services).");
  }
  report.add("connections", static_cast<double>(rtde.counters().connections));
  report.add("broken_streams", static_cast<double>(rtde.counters().broken));
  return report;
}

RobotRecord NetworkArm::record(Narrator& narrator) const {
  const ur::RobotIdentity& identity = robot_->identity();
  const ur::UrDelays& delays = robot_->robot().delays();
  RobotRecord record;
  record.model = identity.arm_name();
  record.software = fmt::format("{}.{}.{}", identity.version.major, identity.version.minor, identity.version.bugfix);
  record.serial = identity.serial_number();
  record.kinematics_checksums = identity.kinematics.checksums;
  std::copy_n(measured_.model.dh.begin(), record.dh.size(), record.dh.begin());
  if (measured_.near) record.fit = {measured_.near->rms_m, measured_.near->rms_rad};
  record.consent_s = delays.consent_s;
  record.accept_s = delays.accept_s;
  record.stop_s = delays.stop_s;
  record.reports = robot_->robot().rtde().counters().reports;
  record.broken = robot_->robot().rtde().counters().broken;
  narrator.line(
      fmt::format("robot     from Play to consent {:.3f} s, to the first motion {:.3f} s; a segment begins within "
                  "{:.3f} s, a stop stands within {:.3f} s",
                  delays.consent_s, delays.motion_s, delays.accept_s, delays.stop_s));
  return record;
}

}  // namespace firstlook
