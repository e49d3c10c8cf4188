/// A UR robot on the network as the arm of a job, with the kinematics that its factory measured.
#pragma once

#include <memory>
#include <string>

#include "algorithms/kinematics/arm_model.hpp"
#include "app/config/config.hpp"
#include "app/report/run_record.hpp"
#include "hal/api/device_report.hpp"
#include "hal/ur/network_robot.hpp"
#include "platform/linux/terminal.hpp"

namespace firstlook {

/// kConfigBadValue for an arm from a file: a robot on the network tells its kinematics itself.
[[nodiscard]] Status refuse_other_arms(const Config& config);

class NetworkArm final : public hal::ReportingDevice {
 public:
  /// Connects to `config.robot.host` by TCP, identifies it and says so. Errors: those of ur::NetworkRobot::connect,
  /// kDeviceMissing for ports of ours that are taken, and kConfigBadValue for kinematics that are not those of the
  /// configured model, or for a `robot.calibration_file` that is another robot's or none.
  [[nodiscard]] static Result<std::unique_ptr<NetworkArm>> connect(const Config& config, Narrator& narrator);
  /// The same on another network, with its clock until the job begins.
  /// @param own_host  this computer as the controller sees it
  [[nodiscard]] static Result<std::unique_ptr<NetworkArm>> connect(const Config& config, Narrator& narrator,
                                                                   std::unique_ptr<ur::Network> network, Clock& clock,
                                                                   const std::string& own_host);
  ~NetworkArm() override;

  [[nodiscard]] hal::RobotArm& arm() { return robot_->robot(); }
  [[nodiscard]] hal::Pendant& pendant() { return robot_->robot().pendant(); }
  [[nodiscard]] const ArmModel& model() const { return model_; }

  /// Which robot it is, and what keeps it from moving.
  [[nodiscard]] hal::DeviceReport report(Instant now) const override;
  /// After the job: what the report tells of it, and in words what took how long.
  [[nodiscard]] RobotRecord record(Narrator& narrator) const;

 private:
  class Notices;
  NetworkArm();
  [[nodiscard]] Result<ArmModel> measure(const ur::RobotIdentity& robot, const Config& config);
  [[nodiscard]] Result<ArmModel> read_file(const std::string& path, const ArmModel& published, const ArmModel& told);

  std::unique_ptr<Notices> notices_;
  std::unique_ptr<ur::Network> network_;
  std::unique_ptr<ur::NetworkRobot> robot_;
  ArmModel model_;
  std::string host_;
  std::string hash_;  ///< of the controller's kinematics, as ur_calibration_hash
  std::optional<RobotRecord::CalibrationFile> file_;
};

}  // namespace firstlook
