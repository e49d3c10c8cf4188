#include "hal/ur/network_robot.hpp"

#include <algorithm>
#include <cmath>

namespace firstlook::ur {
namespace {

constexpr Duration kLook = milliseconds(5);
constexpr Duration kFirstReport = milliseconds(5000);
constexpr double kSamePayload_kg = 0.01;  // what the pendant shows

/// An error of what is at this address.
std::unexpected<Error> at_host(const NetworkRobotOptions& options, const Error& error) {
  return failure(error.fault, "robot at {}: {}", options.host, error.detail());
}

Result<RobotIdentity> identify(Network& network, Clock& clock) {
  Identification identification(network);
  while (true) {
    if (const auto found = identification.poll(clock.now())) return *found;
    clock.sleep_until(clock.now() + kLook);
  }
}

/// The first report of the joints: RTDE works.
Result<RtdeReport> first_report(Network& network, Clock& clock) {
  RtdeClient rtde(network, UrRobot::kReports_hz);
  const Instant until = clock.now() + kFirstReport;
  while (clock.now() < until) {
    if (const auto report = rtde.poll(clock.now())) return *report;
    clock.sleep_until(clock.now() + kLook);
  }
  const auto& trouble = rtde.trouble();
  return failure(Fault::kDeviceMissing, "{}; from 5.10 on the service may have to be switched on in the settings",
                 trouble ? trouble->detail() : std::string_view("RTDE: nothing came"));
}

}  // namespace

Status check_payload(const RtdeReport& report, double expected_kg) {
  if (expected_kg < 0) return {};
  if (!report.payload_kg) {
    return failure(
        Fault::kConfigBadValue,
        "robot.payload_kg is {}, and this controller (before 3.11 and 5.5.1) does not tell its payload: look "
        "at the pendant, then set robot.payload_kg to -1",
        expected_kg);
  }
  if (std::abs(*report.payload_kg - expected_kg) <= kSamePayload_kg) return {};
  return failure(Fault::kConfigBadValue, "robot.payload_kg is {}, the controller has {:.2f} kg set", expected_kg,
                 *report.payload_kg);
}

Status check_mounting(const RtdeReport& report, bool upright) {
  constexpr double kUpright_rad = 0.05;  // a person sets it by quarter turns, or to a degree
  if (!report.gravity_m_s2) return {};
  const auto& g = *report.gravity_m_s2;
  const double size = std::hypot(g[0], g[1], g[2]);
  if (!(size > 1)) return {};  // nobody has told the controller
  // Either sign: a wrong guess would refuse every robot.
  const double off_rad = std::acos(std::min(1.0, std::abs(g[2]) / size));
  const bool plumb = off_rad <= kUpright_rad;
  if (plumb || !upright) return {};
  return failure(Fault::kConfigBadValue,
                 "arm.mounting is upright, the controller's installation has its base {:.0f} degrees from plumb: "
                 "correct Installation, Mounting on the pendant, or arm.mounting",
                 180 / M_PI * off_rad);
}

Result<std::unique_ptr<NetworkRobot>> NetworkRobot::connect(Network& network, Clock& clock,
                                                            const NetworkRobotOptions& options, NoticeSink* notices) {
  std::unique_ptr<NetworkRobot> made(new NetworkRobot);
  const auto identity = identify(network, clock);
  if (!identity) return at_host(options, identity.error());
  made->identity_ = *identity;
  if (const Status fit = check_robot(*identity, {options.robot.model, options.tcp_offset, options.pendant_starts});
      !fit)
    return at_host(options, fit.error());
  const auto report = first_report(network, clock);
  if (!report) return at_host(options, report.error());
  if (const Status fit = check_payload(*report, options.payload_kg); !fit) return at_host(options, fit.error());
  if (const Status fit = check_mounting(*report, options.upright); !fit) return at_host(options, fit.error());
  made->robot_ = std::make_unique<UrRobot>(network, options.robot, notices);
  return made;
}

}  // namespace firstlook::ur
