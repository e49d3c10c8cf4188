/// A UR controller that moves the arm of a simulated cell, in place of the cell's own: spoken to by the driver alone,
/// while the cell's cameras and grader follow its true joints.
#pragma once

#include <memory>

#include "app/cli/cli.hpp"
#include "app/wiring/network_arm.hpp"
#include "app/wiring/stepped_network.hpp"
#include "hal/sim/faults.hpp"
#include "hal/sim/scene.hpp"
#include "hal/sim/ur_controller/lockstep.hpp"
#include "hal/sim/ur_controller/stepped_service.hpp"
#include "hal/sim/ur_controller/truth_reader.hpp"

namespace firstlook {

class CellRobot {
 public:
  // What robot.host calls a controller in this process, and one where the cell's arm is a UR.
  static constexpr const char* kInProcess = "simulated";
  static constexpr const char* kWhereItCan = "auto";

  /// The controller that `robot.host` names: one in this process, whose time is the job's, or `firstlook ur-sim` on the
  /// network; null where the cell moves its arm itself. Errors: kConfigBadValue and kUsage for what does not go
  /// together, kDeviceMissing when nobody is there.
  [[nodiscard]] static Result<std::unique_ptr<CellRobot>> find(const RunCommand& command, const Config& config,
                                                               const sim::Scene& scene);
  /// Connects the driver; before the job begins.
  [[nodiscard]] Status connect(const Config& config, Narrator& narrator);

  [[nodiscard]] hal::RobotArm& arm() { return stepped_ ? static_cast<hal::RobotArm&>(*stepped_) : arm_->arm(); }
  [[nodiscard]] hal::Pendant& pendant() {
    return stepped_pendant_ ? static_cast<hal::Pendant&>(*stepped_pendant_) : arm_->pendant();
  }
  [[nodiscard]] const ArmModel& model() const { return arm_->model(); }
  [[nodiscard]] RobotRecord record(Narrator& narrator) const { return arm_->record(narrator); }
  [[nodiscard]] bool in_real_time() const { return links_ == nullptr; }
  /// For the cell's cameras and grader alone.
  [[nodiscard]] sim::TrueJointFeed& truth() { return *truth_; }

 private:
  CellRobot() = default;
  [[nodiscard]] Status start_in_process(sim::ur::Timetable timetable, const Config& config, const sim::Scene& scene);
  void install(const Config::Robot& wanted);
  [[nodiscard]] Status find_on_network(const sim::Faults& faults, const Config& config);
  [[nodiscard]] Status follow_steps();

  std::unique_ptr<sim::ur::SimulatedUr> controller_;  ///< in this process
  std::unique_ptr<sim::ur::SteppedService> service_;  ///< its byte streams
  std::optional<sim::ur::LockstepClient> lockstep_;   ///< in another process
  std::unique_ptr<sim::ur::SteppedLinks> links_;      ///< to one whose time is the job's
  std::unique_ptr<sim::ur::TruthReader> truth_;
  std::unique_ptr<NetworkArm> arm_;
  std::optional<SteppedArm> stepped_;
  std::optional<SteppedPendant> stepped_pendant_;
};

}  // namespace firstlook
