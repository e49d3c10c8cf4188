/// A UR robot on the network, identified and found fit before a job: everything that may take its time.
#pragma once

#include <memory>
#include <string>

#include "hal/ur/identification.hpp"
#include "hal/ur/ur_robot.hpp"
#include "platform/loop/clock.hpp"

namespace firstlook::ur {

struct NetworkRobotOptions {
  std::string host;                                   ///< of the controller, as errors name it
  UrRobotOptions robot{};                             ///< another model than this is refused
  double payload_kg = -1;                             ///< that the controller must have set; below 0: any
  std::optional<std::array<double, 6>> tcp_offset{};  ///< the same, as ExpectedRobot has it; empty: any
  bool pendant_starts = false;                        ///< as ExpectedRobot has it
  bool upright = true;  ///< axis 1 stands plumb, the base below; the controller's mounting must say the same
};

class NetworkRobot {
 public:
  /// Takes some seconds of the clock at most. Errors: kDeviceMissing: no controller, or software that does not tell
  /// what is needed; kConfigBadValue: another robot, TCP, payload or mounting than configured; kProtectiveStop: a
  /// safety mode in which nothing may move.
  /// @param network  outlives the robot
  /// @param notices  may be null; outlives the robot
  [[nodiscard]] static Result<std::unique_ptr<NetworkRobot>> connect(Network& network, Clock& clock,
                                                                     const NetworkRobotOptions& options,
                                                                     NoticeSink* notices);
  [[nodiscard]] const RobotIdentity& identity() const { return identity_; }
  [[nodiscard]] UrRobot& robot() { return *robot_; }

 private:
  NetworkRobot() = default;
  RobotIdentity identity_;
  std::unique_ptr<UrRobot> robot_;
};

/// Refuses another payload than expected (kg; below 0: any), and one that an older controller does not tell.
[[nodiscard]] Status check_payload(const RtdeReport& report, double expected_kg);

/// Refuses an arm that is configured as upright where the controller's installation has it tilted. A CB3 does not tell.
/// `target_gravity` counts without its sign, which UR's guide to RTDE does not give; so one that hangs passes, too.
[[nodiscard]] Status check_mounting(const RtdeReport& report, bool upright);

}  // namespace firstlook::ur
