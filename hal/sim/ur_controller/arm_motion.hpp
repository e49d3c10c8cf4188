/// How the simulated arm moves, one control cycle at a time: paths of the joints and of the tool, servoj, speedj,
/// speedl, stops, pauses and the speed slider. Paths are run on a time of their own, so that whatever slows the arm
/// keeps it on its path.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "algorithms/kinematics/arm_model.hpp"
#include "hal/sim/joint_motion.hpp"
#include "hal/sim/ur_controller/rotation_vector.hpp"
#include "hal/sim/ur_controller/tool_path.hpp"

namespace firstlook::sim::ur {

/// What ends a motion with a protective stop.
enum class MotionFault : std::uint8_t { kJointLimit, kOutOfReach, kJointTooFast };
[[nodiscard]] std::string_view name_of(MotionFault fault);

/// How a path hands over to the next one.
struct Blend {
  double radius_m = 0;  ///< of the tool's centre about the path's end; 0: it stops there
  Pose flange_T_tcp = Pose::Identity();
};

class ArmMotion {
 public:
  using Ticket = std::uint64_t;

  ArmMotion(const ArmModel& arm, const JointVector& start_rad);

  /// Straight in joint space, from path_end_rad(). Positive speed (rad/s) and acceleration (rad/s²); a positive
  /// `time_s` wins over the speed.
  Ticket movej(const JointVector& target_rad, double speed_rad_s, double acceleration_rad_s2, double time_s,
               const Blend& blend = {});
  /// Along a path of the tool's centre, which is where `blend` says, from path_end_rad(). m/s, m/s².
  Ticket follow(const ToolPath& path, double speed_m_s, double acceleration_m_s2, double time_s,
                const Blend& blend = {});
  /// Follows a target that is renewed each cycle; `lookahead_s` smooths (0.03 to 0.2).
  void servoj(const JointVector& target_rad, double lookahead_s);
  /// Accelerates every joint to its speed and keeps it.
  void speedj(const JointVector& speed_rad_s, double acceleration_rad_s2);
  /// The same for the flange: m/s and rad/s in Base, m/s².
  void speedl(const Vector6& twist, double acceleration_m_s2);
  /// A person's hand leads the arm in freedrive, straight in joint space, whatever slider and pauses say. False while
  /// anything else moves it.
  bool lead(const JointVector& target_rad, double speed_rad_s, double acceleration_rad_s2);
  /// Brakes with this deceleration (rad/s²), on the path where there is one. Done when the arm stands.
  Ticket stop(double deceleration_rad_s2);
  /// Brakes on the path and waits there, until let go.
  void hold(bool held) { held_ = held; }
  /// Puts a standing arm elsewhere, without a motion: for tests and cells.
  void place(const JointVector& at_rad);

  /// One cycle of `cycle_s` at `speed_fraction` (the slider, 0 to 1). A fault leaves the arm where it was.
  [[nodiscard]] std::optional<MotionFault> step(double cycle_s, double speed_fraction);

  /// A path that blends is done where the next one may begin.
  [[nodiscard]] bool done(Ticket ticket) const { return ticket < ticket_ || mode_ == Mode::kRest || blending(); }
  /// It brakes within the blend radius of its end: another path may begin, else it goes there.
  [[nodiscard]] bool blending() const;
  /// Where a path that begins now begins: where the arm is, or where the one that blends ends.
  [[nodiscard]] const JointVector& path_end_rad() const { return blending() ? path_.end_rad : position_rad_; }
  /// A path or a speed is under way: nobody else may start one.
  [[nodiscard]] bool busy() const { return mode_ != Mode::kRest; }
  /// A hand leads the arm now.
  [[nodiscard]] bool in_hand() const { return mode_ == Mode::kLed; }
  /// A hand moved it last.
  [[nodiscard]] bool led() const { return led_; }
  [[nodiscard]] bool standing() const { return velocity_rad_s_.max_abs() < 1e-9; }
  [[nodiscard]] const JointVector& position_rad() const { return position_rad_; }
  /// Where the joints truly are: after a motion the structure swings about its rest.
  [[nodiscard]] JointVector true_position_rad() const;
  [[nodiscard]] const JointVector& velocity_rad_s() const { return velocity_rad_s_; }
  [[nodiscard]] const JointVector& acceleration_rad_s2() const { return acceleration_rad_s2_; }
  /// How fast the path's own time runs: the slider, ramped, 0 while held.
  [[nodiscard]] double scale() const { return scale_; }

 private:
  enum class Mode : std::uint8_t { kRest, kPath, kServo, kJointSpeed, kFlangeSpeed, kLed, kStopping };

  /// A path that is under way.
  struct Track {
    JointMotion motion;            ///< of the joints, or of metres and radians of the tool's way as one "joint"
    std::optional<ToolPath> tool;  ///< its way; empty: the joints' own
    Blend blend;
    JointVector at_rad, end_rad;
    double time_s = 0;  ///< its own: the slider and pauses slow it
  };

  Ticket begin(Mode mode);
  Ticket begin(Track path);
  void lock();  ///< at once at rest
  [[nodiscard]] double gentle(double speed, double acceleration) const;
  [[nodiscard]] JointVector next(double cycle_s, std::optional<MotionFault>& fault);
  [[nodiscard]] std::optional<JointVector> joints_of(const Pose& base_T_tcp, const Blend& blend,
                                                     const JointVector& near_rad) const;
  void advance_on(Track& path, double step_s, std::optional<MotionFault>& fault) const;
  [[nodiscard]] JointVector next_on_path(double step_s, std::optional<MotionFault>& fault);
  [[nodiscard]] JointVector toward_speed(const JointVector& speed_rad_s, double cycle_s) const;
  [[nodiscard]] JointVector flange_speed(std::optional<MotionFault>& fault) const;
  [[nodiscard]] std::optional<MotionFault> check(const JointVector& next_rad, double cycle_s) const;
  [[nodiscard]] std::optional<MotionFault> advance(double cycle_s, double speed_fraction);
  void follow_structure(double cycle_s);
  void ramp_scale(double cycle_s, double speed_fraction);
  void come_to_rest();

  const ArmModel& arm_;
  Mode mode_ = Mode::kRest;
  Mode stopped_mode_ = Mode::kRest;  ///< what kStopping brakes on
  Ticket ticket_ = 0;
  bool held_ = false;
  bool led_ = false;
  double scale_ = 1;
  double braking_1_s_ = 0;  ///< of the scale, while stopping on a path
  JointVector position_rad_, velocity_rad_s_, acceleration_rad_s2_;
  JointVector slowing_rad_s2_;  ///< decelerations of the last whole cycle of a motion
  double rested_s_ = 0;         ///< since the arm came to rest; 0 while it moves

  Track path_;
  std::optional<Track> leaving_;  ///< the one before, which `path_` began to blend with
  JointVector target_rad_;        ///< of servoj; the speed of speedj
  double lookahead_s_ = 0;
  Vector6 twist_{};
  double acceleration_limit_ = 0;
};

}  // namespace firstlook::sim::ur
