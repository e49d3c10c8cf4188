/// The simulated controller without its interfaces: modes and their transitions, the arm, inputs, outputs, registers.
/// Deterministic; time is the number of control cycles.
#pragma once

#include <string>

#include "hal/sim/ur_controller/arm_motion.hpp"
#include "hal/sim/ur_controller/controller_events.hpp"
#include "hal/sim/ur_controller/controller_identity.hpp"
#include "hal/sim/ur_controller/controller_state.hpp"
#include "hal/sim/ur_controller/pendant_requests.hpp"
#include "hal/sim/ur_controller/rtde_watchdogs.hpp"

namespace firstlook::sim::ur {

class Controller {
 public:
  /// Switched on, arm without power, in a pose from which it can move to all sides.
  explicit Controller(const ControllerIdentity& identity);
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  /// One control cycle.
  void step();

  [[nodiscard]] const ControllerIdentity& identity() const { return identity_; }
  [[nodiscard]] const ControllerState& state() const { return state_; }
  [[nodiscard]] EventLog& events() { return events_; }
  /// Adds an event that happens now.
  void tell(ControllerEvent event);

  // The pendant and the dashboard. What is not possible in this mode does nothing.
  void power_on();
  void power_off();
  void release_brakes();  ///< switches the power on first where that is needed
  /// False within 5 s of the stop: nobody can have looked at its cause.
  [[nodiscard]] bool unlock_protective_stop();
  void restart_safety();  ///< after a violation or a fault; the power is off then
  // What happens to it.
  enum class Program : std::uint8_t { kEnds, kPauses };
  /// @param program  what becomes of the one that runs: both are met, by version and cause
  void protective_stop(std::string_view reason, Program program = Program::kEnds);
  /// Takes the power. @param button  kRobotEmergencyStop: the pendant's, kSystemEmergencyStop: at the safety inputs
  void emergency_stop(bool pressed, SafetyMode button = SafetyMode::kRobotEmergencyStop);
  void safeguard(bool open);  ///< a program that played goes on by itself when it is closed
  /// The safety system has found an error, kViolation or kFault: no power until it is restarted.
  void safety_error(SafetyMode mode);
  /// kReduced (its limits are not), kRecovery (outside of its limits: nothing plays) or back to kNormal.
  void set_limits(SafetyMode mode);
  /// Its computer is switched off and on: the arm stands, nothing is left of programs, registers, tool and payload, and
  /// its clock begins anew.
  void reboot();
  /// Nobody answers yet.
  [[nodiscard]] bool booting() const { return state_.robot_mode == RobotMode::kBooting; }
  /// Its clock is set, by so much.
  void set_clock_forward(double by_s) { clock_s_ += by_s; }
  /// A clock that neither is set nor begins anew, for whoever simulates the world around it.
  [[nodiscard]] double simulated_s() const;
  void set_digital_input(int bit, bool value);

  // The program's life; its content is run by others.
  [[nodiscard]] bool can_play() const;
  void play();  ///< starts, or resumes what was paused
  void pause();
  void stop();  ///< the arm brakes on its path
  /// A popup of the program is on the pendant: the program is paused, and pauses again after each Play, until it is
  /// closed or the program stopped.
  void hold_by_popup();
  void close_popup();  ///< as by its "Continue": the program goes on
  [[nodiscard]] bool held_by_popup() const { return held_by_popup_; }
  /// Opens a dialog in which the operator is asked for a value; it closes with the program.
  [[nodiscard]] PendantRequests::Id ask_operator(RequestedType type, const std::string& message);
  [[nodiscard]] PendantRequests& requests() { return requests_; }
  /// The program may take its cycle.
  [[nodiscard]] bool playing() const { return state_.runtime == RuntimeState::kPlaying; }

  /// Puts a standing arm elsewhere.
  void place(const JointVector& at_rad);
  /// Freedrive without its button, as `freedrive_mode()` asks for: hands may lead the arm, no path can be followed. On
  /// where the arm may move; off holds the arm. Whatever stops the program ends it.
  void set_teach_mode(bool on);
  /// Somebody leads the arm there: by the pendant's freedrive button, or without it in teach mode. False where the arm
  /// may not move, or a program moves it.
  bool lead(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2);
  /// What its encoders show differs from the joints by noise of this sigma, another in each cycle; without this call by
  /// nothing.
  void set_encoders(double sigma_rad, std::uint64_t seed);

  // What programs and clients change.
  [[nodiscard]] ArmMotion& motion() { return motion_; }
  [[nodiscard]] const ArmMotion& motion() const { return motion_; }
  [[nodiscard]] InputsOutputs& io() { return state_.io; }
  [[nodiscard]] Registers& inputs() { return state_.inputs; }
  [[nodiscard]] RtdeWatchdogs& watchdogs() { return watchdogs_; }
  [[nodiscard]] Registers& outputs() { return state_.outputs; }
  void set_speed_slider(double fraction);  ///< clamped to 0..1; not finite: ignored
  void set_payload(const Payload& payload) { state_.payload = payload; }
  void set_gravity(const Vector3& gravity_m_s2) { state_.gravity_m_s2 = gravity_m_s2; }
  void set_external_wrench(const Vector6& wrench) { state_.external_wrench = wrench; }
  void set_tcp_offset(const Vector6& flange_T_tcp);
  void set_script_line(std::uint32_t line) { state_.script_line = line; }

  /// What is said of the actual joints, with the encoders' noise, and the pose of the TCP by them.
  [[nodiscard]] Vector6 measured_q_rad() const;
  [[nodiscard]] Vector6 measured_tcp_pose() const;
  /// base_T_tcp of these joints.
  [[nodiscard]] Pose tcp_pose(const JointVector& q_rad) const;
  [[nodiscard]] Pose flange_T_tcp() const { return pose_of(state_.tcp_offset); }

 private:
  void advance_modes();
  void advance_runtime();
  void report_arm();
  void set_safety(SafetyMode mode);

  ControllerIdentity identity_;
  ArmMotion motion_;
  ControllerState state_;
  EventLog events_;
  RtdeWatchdogs watchdogs_;
  PendantRequests requests_;
  double clock_s_;  ///< that its clock showed in cycle `clock_from_`
  std::uint64_t clock_from_ = 0;
  std::uint64_t mode_until_ = 0;  ///< the cycle in which kPowerOn, or the release of brakes, ends; 0: nothing under way
  bool releasing_ = false;
  std::uint64_t protective_since_ = 0;
  SafetyMode emergency_ = SafetyMode::kNormal;  ///< the button that is pressed
  bool resume_after_safeguard_ = false;
  bool held_by_popup_ = false;
  double encoder_sigma_rad_ = 0;
  std::uint64_t encoder_seed_ = 0;
  bool arm_reported_ = false;  ///< poses are those of the joints
};

}  // namespace firstlook::sim::ur
