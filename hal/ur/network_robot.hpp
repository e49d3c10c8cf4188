/// A UR robot on the network, identified and found fit before a job: everything that may take its time.
#pragma once

#include <memory>
#include <string>

#include "hal/ur/identification.hpp"
#include "hal/ur/tcp_network.hpp"
#include "hal/ur/ur_robot.hpp"

namespace firstlook::ur {

struct NetworkRobotOptions {
  TcpNetworkOptions network;
  std::string own_address = "auto";  ///< this computer's, as the controller sees it; auto: found out
  std::string arm;                   ///< the configured model; another one is refused
  double payload_kg = -1;            ///< that the controller must have set; below 0: any
};

class NetworkRobot {
 public:
  /// Blocks for some seconds at most. Errors: kDeviceMissing: no controller, a port of ours that is taken, or software
  /// that does not tell what is needed; kConfigBadValue: another robot or payload than configured; kProtectiveStop:
  /// a safety mode in which nothing may move.
  /// @param notices  may be null; outlives the robot
  [[nodiscard]] static Result<std::unique_ptr<NetworkRobot>> connect(const NetworkRobotOptions& options,
                                                                     NoticeSink* notices);
  [[nodiscard]] const RobotIdentity& identity() const { return identity_; }
  [[nodiscard]] UrRobot& robot() { return *robot_; }

 private:
  NetworkRobot() = default;
  TcpNetwork network_;
  RobotIdentity identity_;
  std::unique_ptr<UrRobot> robot_;
};

/// Refuses another payload than expected (kg; below 0: any), and one that an older controller does not tell.
[[nodiscard]] Status check_payload(const RtdeReport& report, double expected_kg);

}  // namespace firstlook::ur
