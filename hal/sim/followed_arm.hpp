/// The true body of an arm that another process moves: cameras and grader follow its joints; the program under test
/// cannot reach them.
#pragma once

#include <array>
#include <optional>

#include "algorithms/kinematics/arm_model.hpp"
#include "hal/sim/pose_deviation.hpp"
#include "hal/sim/true_motion.hpp"
#include "platform/loop/clock_mapping.hpp"

namespace firstlook::sim {

/// True joints as they come from whoever moves the arm.
class TrueJointFeed {
 public:
  struct Sample {
    double there_s = 0;  ///< on the clock over there
    JointVector joints_rad;
    bool led = false;  ///< by a person's hand, or left where a hand led it
  };
  virtual ~TrueJointFeed() = default;
  /// The DH table that the true arm has.
  [[nodiscard]] virtual const std::array<DhRow, kJointsMax>& true_dh() const = 0;
  /// The next sample, oldest first; empty when none has come. Never blocks.
  [[nodiscard]] virtual std::optional<Sample> next() = 0;
  /// The body touches something: the arm over there feels it.
  virtual void touched() = 0;
  /// A person leads the arm by hand; it does not follow where it may not move or moves already.
  virtual void lead(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2) = 0;
};

class FollowedArm final : public TrueMotion {
 public:
  /// @param model    with the true DH table
  /// @param watcher  may be null
  FollowedArm(TrueJointFeed& feed, const ArmModel& model, std::uint64_t seed, const DeviationSigmas& deviation,
              BodyWatcher* watcher);

  void advance(Instant now) override;
  [[nodiscard]] Instant known_until() const override;
  /// Between samples on a straight line; before the oldest kept it is that one.
  [[nodiscard]] JointVector true_joints(Instant stamp) const override;
  [[nodiscard]] Transform<Base, Flange> true_flange(const JointVector& true_joints_rad) const override;
  [[nodiscard]] std::optional<double> lead(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2,
                                           Instant now) override;

 private:
  struct Moment {
    Instant stamp{};
    JointVector joints_rad;
  };
  /// Newest first; 0 is the newest.
  [[nodiscard]] const Moment& moment(std::uint64_t back) const { return moments_[(count_ - 1 - back) % kKept]; }

  static constexpr std::size_t kKept = 1024;  // 8 s at 125 Hz; frames ask for the last tenths of a second

  TrueJointFeed& feed_;
  ArmModel model_;
  PoseDeviation deviation_;
  BodyWatcher* watcher_;
  ClockMapping clock_;
  std::array<Moment, kKept> moments_{};
  std::uint64_t count_ = 0;  ///< of all that came; the newest is at (count_ - 1) % kKept
  bool touches_ = false;
};

}  // namespace firstlook::sim
