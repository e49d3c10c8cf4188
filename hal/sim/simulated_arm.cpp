#include "hal/sim/simulated_arm.hpp"

#include <algorithm>
#include <cmath>

#include "hal/sim/random_streams.hpp"
#include "platform/core/ensure.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook::sim {
namespace {

// Category 0 stops of a UR5 at 180 deg/s take .31, .70 and .22 rad for base, shoulder and elbow (CB3 manual, appendix
// A): v² / 2 theta is 15.9, 7.0 and 22.4 rad/s². Rounded down; the wrists as the elbow.
constexpr std::array<double, kJointsMax> kBrake_rad_s2 = {12, 6, 16, 16, 16, 16, 16};

// External Control reads with a timeout of this order; when it expires the robot's own script stops.
constexpr Duration kDeadMan = milliseconds(100);

}  // namespace

SimulatedArm::SimulatedArm(const SimulatedArmOptions& options, BodyWatcher* watcher)
    : model_(options.model),
      script_(options.script),
      watcher_(watcher),
      deviation_(options.seed, options.deviation),
      encoder_(options.seed, kEncoderStream),
      encoder_sigma_rad_(options.encoder_sigma_rad),
      next_tick_{kReportPeriod.ns},
      last_true_rad_(options.start_rad) {
  ENSURE(5002, options.start_rad.size() == model_.joints);
  const std::string_view name = model_.name;
  const std::size_t length = std::min(name.size(), model_name_.size() - 1);
  std::copy_n(name.begin(), length, model_name_.begin());
  std::stable_sort(script_.begin(), script_.end(),
                   [](const ControllerEvent& a, const ControllerEvent& b) { return a.stamp < b.stamp; });
  motions_[0] = rest(Instant{}, options.start_rad);
}

void SimulatedArm::begin(const JointMotion& motion) {
  newest_ = (newest_ + 1) % kMotionsKept;
  motions_[newest_] = motion;
}

void SimulatedArm::brake(Instant now) {
  if (current().moving(now)) begin(brake_on_path(current(), now, kBrake_rad_s2));
}

void SimulatedArm::apply(const ControllerEvent& event) {
  switch (event.action) {
    case ControllerAction::kPlay:
      running_ = safety_ == hal::ArmSafety::kNormal;
      return;
    case ControllerAction::kProtectiveStop:
      safety_ = hal::ArmSafety::kProtectiveStop;
      break;
    case ControllerAction::kEmergencyStop:
      safety_ = hal::ArmSafety::kEmergencyStop;
      break;
    case ControllerAction::kLinkLost:
      connected_ = false;
      dead_man_ = event.stamp + kDeadMan;
      return;
    case ControllerAction::kPause:
    case ControllerAction::kStop:
      break;
  }
  if (running_ || current().moving(event.stamp)) ++counters_.stops;
  running_ = false;
  brake(event.stamp);
}

void SimulatedArm::tick(Instant stamp) {
  if (stamp >= dead_man_) {
    running_ = false;
    brake(stamp);
    dead_man_ = kNeverDue;
  }
  const JointVector now_true_rad = current().true_position_rad(stamp);
  if (led_ && watcher_ != nullptr) watcher_->body_led();
  const bool contact = !led_ && watcher_ != nullptr && watcher_->body_moved(stamp, last_true_rad_, now_true_rad);
  last_true_rad_ = now_true_rad;
  if (contact && safety_ == hal::ArmSafety::kNormal) apply({stamp, ControllerAction::kProtectiveStop});

  hal::ArmState state;
  state.stamp = stamp;
  state.position_rad = current().position_rad(stamp);
  for (int j = 0; j < model_.joints; ++j) state.position_rad[j] += encoder_sigma_rad_ * encoder_.normal();
  state.velocity_rad_s = current().velocity_rad_s(stamp);
  state.safety = safety_;
  state.program_running = running_;
  state.moving = !led_ && current().moving(stamp);
  state.segment = segment_;
  if (!connected_) return;
  if (reports_.full()) static_cast<void>(reports_.pop());
  reports_.push(state);
}

void SimulatedArm::advance(Instant now) {
  while (next_tick_ <= now || (script_next_ < script_.size() && script_[script_next_].stamp <= now)) {
    if (script_next_ < script_.size() && script_[script_next_].stamp <= next_tick_) {
      apply(script_[script_next_++]);
      continue;
    }
    tick(next_tick_);
    next_tick_ = next_tick_ + kReportPeriod;
  }
  simulated_ = std::max(simulated_, now);
}

std::optional<hal::ArmState> SimulatedArm::poll(Instant now) {
  const memory::SimulationScope simulation;
  advance(now);
  if (reports_.empty()) return std::nullopt;
  ++counters_.states;
  return reports_.pop();
}

Instant SimulatedArm::next_due() const {
  if (!reports_.empty()) return simulated_;
  return connected_ ? next_tick_ : kNeverDue;
}

Status SimulatedArm::check(const hal::Segment& segment, const JointVector& from_rad) const {
  if (segment.target_rad.size() != model_.joints || !segment.target_rad.all_finite()) {
    return failure(Fault::kMoveRefused, "segment {}: target is not {} finite joint angles", segment.number,
                   model_.joints);
  }
  if (!(segment.speed_rad_s > 0) || !(segment.acceleration_rad_s2 > 0) ||
      segment.acceleration_rad_s2 > model_.acceleration_max_rad_s2) {
    return failure(Fault::kMoveRefused, "segment {}: speed {} rad/s or acceleration {} rad/s2 out of range",
                   segment.number, segment.speed_rad_s, segment.acceleration_rad_s2);
  }
  const JointVector way_rad = segment.target_rad - from_rad;
  const double leading_rad = way_rad.max_abs();
  for (int j = 0; j < model_.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    if (segment.target_rad[j] < model_.lower_rad[i] || segment.target_rad[j] > model_.upper_rad[i]) {
      return failure(Fault::kMoveRefused, "segment {}: joint {} beyond its limit", segment.number, j + 1);
    }
    const double share = leading_rad > 0 ? std::abs(way_rad[j]) / leading_rad : 0.0;
    if (share * segment.speed_rad_s > model_.speed_max_rad_s[i]) {
      return failure(Fault::kMoveRefused, "segment {}: joint {} too fast", segment.number, j + 1);
    }
  }
  return {};
}

Status SimulatedArm::move(const hal::Segment& segment, Instant now) {
  const memory::SimulationScope simulation;
  advance(now);
  const auto refuse = [&](Status status) {
    ++counters_.refused;
    return status;
  };
  if (!connected_) return refuse(failure(Fault::kLinkLost, "segment {}: no connection", segment.number));
  if (safety_ != hal::ArmSafety::kNormal) {
    return refuse(failure(Fault::kProtectiveStop, "segment {}: the arm is stopped", segment.number));
  }
  if (!running_) return refuse(failure(Fault::kProgramStopped, "segment {}: no program runs", segment.number));
  if (current().moving(now)) {
    return refuse(failure(Fault::kProgramStopped, "segment {}: segment {} is still running", segment.number, segment_));
  }
  const JointVector from_rad = current().position_rad(now);
  if (Status status = check(segment, from_rad); !status) return refuse(status);
  begin(movej(now, from_rad, segment.target_rad, segment.speed_rad_s, segment.acceleration_rad_s2));
  led_ = false;
  segment_ = segment.number;
  ++counters_.segments;
  return {};
}

std::optional<double> SimulatedArm::lead(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2,
                                         Instant now) {
  advance(now);
  if (current().moving(now)) return std::nullopt;
  begin(movej(now, current().position_rad(now), to_rad, speed_rad_s, acceleration_rad_s2));
  led_ = true;
  return current().duration_s();
}

void SimulatedArm::stop(Instant now) {
  const memory::SimulationScope simulation;
  advance(now);
  ++counters_.stops;
  if (connected_) brake(now);
}

JointVector SimulatedArm::true_joints(Instant stamp) const {
  const JointMotion* found = &current();
  for (std::size_t back = 0; back < kMotionsKept; ++back) {
    const JointMotion& motion = motions_[(newest_ + kMotionsKept - back) % kMotionsKept];
    if (motion.origin_rad.size() == 0) break;  // never used
    found = &motion;
    if (motion.start <= stamp) break;
  }
  return found->true_position_rad(stamp);
}

Transform<Base, Flange> SimulatedArm::true_flange(const JointVector& true_joints_rad) const {
  return forward(model_, true_joints_rad).flange() * deviation_.at(true_joints_rad);
}

}  // namespace firstlook::sim
