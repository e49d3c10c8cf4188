/// Which robot is there: read once before a job, from the primary interface and the dashboard.
#pragma once

#include <optional>
#include <string_view>

#include "hal/ur/dashboard_client.hpp"
#include "hal/ur/network.hpp"
#include "hal/ur/primary_codec.hpp"
#include "platform/core/time.hpp"

namespace firstlook::ur {

struct RobotIdentity {
  ControllerVersion version;
  int robot_type = 0;
  std::array<char, 16> arm{};  ///< as ArmModel names it; empty for one that firstlook does not know
  std::array<char, 32> serial{};
  Kinematics kinematics;
  int robot_mode = -1;
  int safety_mode = 0;
  std::array<double, 6> tcp_offset{};
  bool remote_control = false;  ///< programs are started by the network, not by a person at the pendant; e-Series only

  [[nodiscard]] std::string_view arm_name() const { return arm.data(); }
  [[nodiscard]] std::string_view serial_number() const { return serial.data(); }
};

class Identification {
 public:
  static constexpr Duration kWhole = milliseconds(5000);  ///< limit for all of it

  explicit Identification(Network& network) : network_(network), dashboard_(network) {}
  ~Identification();
  Identification(const Identification&) = delete;
  Identification& operator=(const Identification&) = delete;

  /// Goes on with what can be done now; empty: not yet. Error: kDeviceMissing: no controller there, or one that does
  /// not tell what is needed. A dashboard that does not answer costs the serial number only.
  [[nodiscard]] std::optional<Result<RobotIdentity>> poll(Instant now);

 private:
  [[nodiscard]] Status read(const PrimaryPacket& packet);
  [[nodiscard]] bool complete() const;

  Network& network_;
  DashboardClient dashboard_;
  bool dashboard_ends_ = false;
  LinkId link_ = kNoLink;
  bool connected_ = false;
  std::optional<Instant> until_;
  Inbox<16384> inbox_;
  std::optional<ControllerVersion> version_;
  PrimaryState state_;
};

/// What the configuration says of the robot.
struct ExpectedRobot {
  std::string_view arm;  ///< as ArmModel names it
  /// The TCP that must be set: m, and a rotation vector in rad; empty: any.
  std::optional<std::array<double, 6>> tcp_offset{};
  bool pendant_starts = false;  ///< a person's Play on the pendant is the only consent (start_source: pendant)
};
/// Refuses a robot that is not as configured, or must not be moved as it is. Errors: kConfigBadValue for another model
/// or TCP, or for remote control where a person is to press Play, kProtectiveStop for a safety mode in which nothing
/// may move, kDeviceMissing for software that is too old.
[[nodiscard]] Status check_robot(const RobotIdentity& robot, const ExpectedRobot& expected);

}  // namespace firstlook::ur
