/// A UR arm with its controller: movej timing, limits, consent, protective stops; and where its flange truly is.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "algorithms/kinematics/arm_model.hpp"
#include "hal/api/robot_arm.hpp"
#include "hal/sim/joint_motion.hpp"
#include "hal/sim/pose_deviation.hpp"
#include "hal/sim/true_motion.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/core/random.hpp"
#include "platform/core/transform.hpp"

namespace firstlook::sim {

inline constexpr Duration kReportPeriod = milliseconds(8);  // RTDE of a CB3 controller: 125 Hz
inline constexpr double kEncoderSigma_rad = 2e-5;           // of what an arm says of its joints

/// What a person or a mishap does to the controller.
enum class ControllerAction : std::uint8_t { kPlay, kPause, kStop, kProtectiveStop, kEmergencyStop, kLinkLost };

struct ControllerEvent {
  Instant stamp{};
  ControllerAction action = ControllerAction::kPlay;
};
inline constexpr std::size_t kControllerEventsMax = 16;
using ControllerScript = FixedVector<ControllerEvent, kControllerEventsMax>;

struct SimulatedArmOptions {
  ArmModel model;
  JointVector start_rad;
  std::uint64_t seed = 1;
  ControllerScript script;  ///< by time
  double encoder_sigma_rad = kEncoderSigma_rad;
  DeviationSigmas deviation;
};

/// All calls but true_flange from the loop thread. Time only moves forward: a call with an earlier `now` changes
/// nothing.
class SimulatedArm final : public hal::RobotArm, public TrueMotion {
 public:
  explicit SimulatedArm(const SimulatedArmOptions& options, BodyWatcher* watcher = nullptr);

  [[nodiscard]] const char* model() const override { return model_name_.data(); }
  [[nodiscard]] std::optional<hal::ArmState> poll(Instant now) override;
  [[nodiscard]] Instant next_due() const override;
  [[nodiscard]] Status move(const hal::Segment& segment, Instant now) override;
  void stop(Instant now) override;
  [[nodiscard]] hal::ArmCounters counters() const override { return counters_; }

  [[nodiscard]] std::optional<double> lead(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2,
                                           Instant now) override;
  /// Lets the controller run up to `now`; reports pile up for poll.
  void advance(Instant now) override;
  [[nodiscard]] Instant known_until() const override { return simulated_; }
  /// Where the joints truly are or were, ring-down included. Back to kMotionsKept moves before the newest.
  [[nodiscard]] JointVector true_joints(Instant stamp) const override;
  [[nodiscard]] Transform<Base, Flange> true_flange(const JointVector& true_joints_rad) const override;

 private:
  static constexpr std::size_t kMotionsKept = 64;
  static constexpr std::size_t kReportsKept = 256;

  void apply(const ControllerEvent& event);
  void tick(Instant stamp);
  void brake(Instant now);
  void begin(const JointMotion& motion);
  [[nodiscard]] const JointMotion& current() const { return motions_[newest_]; }
  [[nodiscard]] Status check(const hal::Segment& segment, const JointVector& from_rad) const;

  ArmModel model_;
  std::array<char, 16> model_name_{};
  ControllerScript script_;
  BodyWatcher* watcher_;
  PoseDeviation deviation_;
  Random encoder_;
  double encoder_sigma_rad_;

  std::array<JointMotion, kMotionsKept> motions_{};
  std::size_t newest_ = 0;
  FixedQueue<hal::ArmState, kReportsKept> reports_;
  std::size_t script_next_ = 0;
  Instant simulated_{};  ///< everything up to here has happened
  Instant next_tick_{};
  JointVector last_true_rad_;
  hal::ArmSafety safety_ = hal::ArmSafety::kNormal;
  bool running_ = false;
  bool led_ = false;  ///< by hand
  bool connected_ = true;
  Instant dead_man_ = kNeverDue;  ///< the robot's own script stops when it hears nothing until then
  std::uint32_t segment_ = 0;
  hal::ArmCounters counters_;
};

}  // namespace firstlook::sim
