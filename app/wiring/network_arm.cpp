#include "app/wiring/network_arm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "algorithms/kinematics/factory_kinematics.hpp"
#include "app/config/ur_calibration_file.hpp"
#include "app/wiring/job_site.hpp"
#include "hal/ur/modes.hpp"
#include "hal/ur/tcp_network.hpp"

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
  auto network = std::make_unique<ur::TcpNetwork>();
  const Status opened =
      network->open({config.robot.host, config.robot.port_offset, static_cast<std::uint16_t>(config.robot.program_port),
                     static_cast<std::uint16_t>(config.robot.control_port)});
  if (!opened) return std::unexpected(opened.error());
  std::string own_host = config.robot.own_address;
  if (own_host == "auto") {
    const auto own = network->own_address();
    if (!own) return failure(own.error().fault, "robot at {}: {}", config.robot.host, own.error().detail());
    own_host = *own;
  }
  RealClock clock;
  return connect(config, narrator, std::move(network), clock, own_host);
}

Result<std::unique_ptr<NetworkArm>> NetworkArm::connect(const Config& config, Narrator& narrator,
                                                        std::unique_ptr<ur::Network> network, Clock& clock,
                                                        const std::string& own_host) {
  std::unique_ptr<NetworkArm> arm(new NetworkArm);
  arm->notices_ = std::make_unique<Notices>(narrator);
  arm->network_ = std::move(network);
  arm->host_ = config.robot.host;
  ur::NetworkRobotOptions options;
  options.host = config.robot.host;
  options.robot = {config.arm.model, own_host, static_cast<std::uint16_t>(config.robot.control_port)};
  options.payload_kg = config.robot.payload_kg;
  options.upright = config.arm.mounting == "upright";
  options.pendant_starts = config.start_source == "pendant";
  if (config.robot.tcp_offset) {
    auto& tcp = options.tcp_offset.emplace();
    for (std::size_t i = 0; i < tcp.size(); ++i) tcp[i] = (*config.robot.tcp_offset)[static_cast<int>(i)];
  }
  auto connected = ur::NetworkRobot::connect(*arm->network_, clock, options, arm->notices_.get());
  if (!connected) return std::unexpected(connected.error());
  arm->robot_ = std::move(*connected);
  const ur::RobotIdentity& identity = arm->robot_->identity();
  auto measured = arm->measure(identity, config);
  if (!measured) return std::unexpected(measured.error());
  arm->model_ = *measured;
  narrator.line(fmt::format(
      "robot     {} {}, serial number {}, kinematics as its factory measured them{}", config.arm.model,
      names_network_robot(config) ? "at " + config.robot.host : "with a simulated controller", identity.serial_number(),
      arm->file_ ? fmt::format(", from {}, as the controller has them", arm->file_->path) : ""));
  return arm;
}

/// The file's kinematics, where they are the controller's.
Result<ArmModel> NetworkArm::read_file(const std::string& path, const ArmModel& published, const ArmModel& told) {
  // Files have 16 digits; this is a thousandth of what a correction corrects.
  constexpr double kSame_m = 2e-5, kSame_rad = 2e-5;
  const auto file = read_ur_calibration(path);
  if (!file) return failure(file.error().fault, "robot.calibration_file: {}", file.error().detail());
  ArmModel arm = with_factory_frames(published, file->frames).arm;
  const FlangeDifference off = flange_difference(arm, told);
  if (off.m > kSame_m || off.rad > kSame_rad) {
    return failure(
        Fault::kConfigBadValue,
        "robot.calibration_file {:.60}: of another robot ({}, here {}): the flange would be off by {:.2f} mm, "
        "{:.2f} mrad. Have calibration_correction write it anew, or set none",
        path, file->hash.empty() ? "no hash" : file->hash, hash_, 1e3 * off.m, 1e3 * off.rad);
  }
  file_ = RobotRecord::CalibrationFile{path, file->hash, file->hash == hash_, off.m};
  return arm;
}

/// The configured model with the kinematics that the robot's factory measured.
Result<ArmModel> NetworkArm::measure(const ur::RobotIdentity& robot, const Config& config) {
  constexpr double kOff_m = 0.02, kOff_rad = 0.05;  // ten times what a factory corrects
  const ArmModel published = find_arm_model(config.arm.model).value();
  std::array<DhRow, kJointsMax> told{};
  for (std::size_t j = 0; j < robot.kinematics.rows.size(); ++j) {
    const ur::KinematicsRow& row = robot.kinematics.rows[j];
    told[j] = {row.theta_rad, row.d_m, row.a_m, row.alpha_rad};
  }
  const MeasuredArm measured = with_factory_axes(published, told);
  if (measured.frames_off_m > kOff_m || measured.frames_off_rad > kOff_rad) {
    return failure(Fault::kConfigBadValue,
                   "robot at {}: its kinematics are not those of a {}: a link would be off by {:.1f} mm, {:.1f} mrad",
                   config.robot.host, published.name.view(), 1e3 * measured.frames_off_m,
                   1e3 * measured.frames_off_rad);
  }
  hash_ = ur_calibration_hash(std::span(told).first<6>());
  if (config.robot.calibration_file == "none") return measured.arm;
  return read_file(config.robot.calibration_file, published, measured.arm);
}

hal::DeviceReport NetworkArm::report(Instant) const {
  const ur::RobotIdentity& robot = robot_->identity();
  const ur::RtdeClient& rtde = robot_->robot().rtde();
  const auto newest = robot_->robot().newest_report();
  const int mode = newest ? newest->robot_mode : robot.robot_mode;
  hal::DeviceReport report;
  report.state = rtde.streaming() ? hal::DeviceState::kReady : hal::DeviceState::kStarting;
  report.device.set("{} at {}", robot.arm_name(), host_);
  report.detail.set("software {}.{}.{}, serial number {}, factory kinematics {:08x}, {}", robot.version.major,
                    robot.version.minor, robot.version.bugfix, robot.serial_number(), robot.kinematics.checksums[0],
                    ur::robot_mode_name(mode));
  if (mode != ur::kRobotModeRunning) {
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
  record.calibration_hash = hash_;
  record.calibration_file = file_;
  std::copy_n(model_.dh.begin(), record.dh.size(), record.dh.begin());
  record.consent_s = delays.consent_s;
  record.accept_s = delays.accept_s;
  record.stop_s = delays.stop_s;
  record.react_s = delays.react_s;
  record.lost_s = delays.lost_s;
  record.reports = robot_->robot().rtde().counters().reports;
  record.broken = robot_->robot().rtde().counters().broken;
  narrator.line(
      fmt::format("robot     from Play to consent {:.3f} s, to the first motion {:.3f} s; a segment begins within "
                  "{:.3f} s{}",
                  delays.consent_s, delays.motion_s, delays.accept_s,
                  delays.stop_s > 0 ? fmt::format(", a stop stands within {:.3f} s", delays.stop_s) : ""));
  return record;
}

}  // namespace firstlook
