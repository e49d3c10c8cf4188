#include "hal/sim/followed_arm.hpp"

#include <algorithm>

#include "hal/sim/joint_motion.hpp"
#include "platform/core/ensure.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook::sim {

FollowedArm::FollowedArm(TrueJointFeed& feed, const ArmModel& model, std::uint64_t seed,
                         const DeviationSigmas& deviation, BodyWatcher* watcher)
    : feed_(feed), model_(model), deviation_(seed, deviation), watcher_(watcher) {}

void FollowedArm::advance(Instant now) {
  const memory::SimulationScope simulation;
  while (const auto sample = feed_.next()) {
    const Moment moment{clock_.to_ours(sample->there_s, now), sample->joints_rad};
    if (watcher_ != nullptr && sample->led) {
      watcher_->body_led();
      touches_ = false;
    } else if (watcher_ != nullptr) {
      const JointVector& before_rad = count_ > 0 ? moments_[(count_ - 1) % kKept].joints_rad : moment.joints_rad;
      const bool touches = watcher_->body_moved(moment.stamp, before_rad, moment.joints_rad);
      if (touches && !touches_) feed_.touched();
      touches_ = touches;
    }
    moments_[count_++ % kKept] = moment;
  }
}

Instant FollowedArm::known_until() const { return count_ > 0 ? moment(0).stamp : Instant{-1}; }

JointVector FollowedArm::true_joints(Instant stamp) const {
  ENSURE(5111, count_ > 0);
  const std::uint64_t oldest = count_ > kKept ? count_ - kKept : 0;
  for (std::uint64_t i = count_ - 1; i > oldest; --i) {
    const Moment& after = moments_[i % kKept];
    const Moment& before = moments_[(i - 1) % kKept];
    if (stamp >= after.stamp) return after.joints_rad;
    if (stamp < before.stamp) continue;
    const double share = (stamp - before.stamp).seconds() / (after.stamp - before.stamp).seconds();
    return interpolate(before.joints_rad, after.joints_rad, share);
  }
  return moments_[oldest % kKept].joints_rad;
}

std::optional<double> FollowedArm::lead(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2,
                                        Instant now) {
  constexpr double kStanding_rad = 1e-4;  // between two samples: what rings down, and no motion
  advance(now);
  if (count_ < 2 || (moment(0).joints_rad - moment(1).joints_rad).max_abs() > kStanding_rad) return std::nullopt;
  feed_.lead(to_rad, speed_rad_s, acceleration_rad_s2);
  return movej(now, moment(0).joints_rad, to_rad, speed_rad_s, acceleration_rad_s2).duration_s();
}

Transform<Base, Flange> FollowedArm::true_flange(const JointVector& true_joints_rad) const {
  return forward(model_, true_joints_rad).flange() * deviation_.at(true_joints_rad);
}

}  // namespace firstlook::sim
