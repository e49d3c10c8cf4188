/// A scripted arm for unit tests: an ideal controller that reports at 125 Hz, moves linearly, and does what the test
/// says.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <vector>

#include "hal/api/robot_arm.hpp"

namespace firstlook::mock {

class MockRobotArm final : public hal::RobotArm {
 public:
  static constexpr Duration kPeriod = milliseconds(8);

  explicit MockRobotArm(const JointVector& start_rad = JointVector::zero(6))
      : at_rad_(start_rad), from_rad_(start_rad) {}

  // The script.
  void at(Instant stamp, std::function<void(MockRobotArm&)> change) { script_.push_back({stamp, std::move(change)}); }
  void set_running(bool running) {
    running_ = running;
    if (!running) halt();
  }
  void set_safety(hal::ArmSafety safety) {
    safety_ = safety;
    if (safety != hal::ArmSafety::kNormal) set_running(false);
  }
  void set_connected(bool connected) { connected_ = connected; }
  void set_position(const JointVector& q_rad) { at_rad_ = q_rad; }  ///< as if it had been jogged
  void refuse_next(Fault fault) { refusal_ = fault; }

  // What it was told.
  std::vector<hal::Segment> moves;
  std::vector<Instant> stops;

  [[nodiscard]] const char* model() const override { return "ur5"; }

  [[nodiscard]] std::optional<hal::ArmState> poll(Instant now) override {
    advance(now);
    if (reports_.empty()) return std::nullopt;
    const hal::ArmState state = reports_.front();
    reports_.pop_front();
    ++counters_.states;
    return state;
  }
  [[nodiscard]] Instant next_due() const override { return reports_.empty() ? next_ : reports_.front().stamp; }

  [[nodiscard]] Status move(const hal::Segment& segment, Instant now) override {
    advance(now);
    const Status status = check(segment);
    if (!status) {
      ++counters_.refused;
      return status;
    }
    moves.push_back(segment);
    ++counters_.segments;
    number_ = segment.number;
    from_rad_ = at_rad_;
    to_rad_ = segment.target_rad;
    began_ = now;
    const double way_rad = (to_rad_ - from_rad_).max_abs();
    duration_s_ = way_rad / segment.speed_rad_s;
    moving_ = way_rad > 0;
    return {};
  }
  void stop(Instant now) override {
    advance(now);
    stops.push_back(now);
    ++counters_.stops;
    halt();
  }
  [[nodiscard]] hal::ArmCounters counters() const override { return counters_; }

 private:
  struct Change {
    Instant stamp;
    std::function<void(MockRobotArm&)> apply;
  };

  Status check(const hal::Segment& segment) {
    if (refusal_) {
      const Fault fault = *refusal_;
      refusal_.reset();
      return failure(fault, "segment {}: refused by the test", segment.number);
    }
    if (!connected_) return failure(Fault::kLinkLost, "segment {}", segment.number);
    if (safety_ != hal::ArmSafety::kNormal) return failure(Fault::kProtectiveStop, "segment {}", segment.number);
    if (!running_ || moving_) return failure(Fault::kProgramStopped, "segment {}", segment.number);
    const bool angles = segment.target_rad.size() == at_rad_.size() && segment.target_rad.all_finite() &&
                        segment.target_rad.max_abs() <= 6.2832;
    if (!angles || !(segment.speed_rad_s > 0) || !(segment.acceleration_rad_s2 > 0) || segment.speed_rad_s > 3.2) {
      return failure(Fault::kMoveRefused, "segment {}", segment.number);
    }
    return {};
  }
  void halt() { moving_ = false; }

  void advance(Instant now) {
    for (; next_ <= now; next_ = next_ + kPeriod) {
      for (Change& change : script_) {
        if (change.apply && change.stamp <= next_) std::exchange(change.apply, nullptr)(*this);
      }
      report(next_);
    }
  }
  void report(Instant stamp) {
    hal::ArmState state;
    if (moving_) {
      const double t = duration_s_ > 0 ? std::clamp((stamp - began_).seconds() / duration_s_, 0.0, 1.0) : 1.0;
      at_rad_ = interpolate(from_rad_, to_rad_, t);
      moving_ = t < 1;
      if (moving_) state.velocity_rad_s = (to_rad_ - from_rad_) * (1 / duration_s_);
    }
    if (!moving_) state.velocity_rad_s = JointVector::zero(at_rad_.size());
    state.stamp = stamp;
    state.position_rad = at_rad_;
    state.safety = safety_;
    state.program_running = running_;
    state.moving = moving_;
    state.segment = number_;
    if (connected_) reports_.push_back(state);
  }

  std::vector<Change> script_;
  std::deque<hal::ArmState> reports_;
  Instant next_{kPeriod.ns};
  JointVector at_rad_, from_rad_, to_rad_;
  Instant began_{};
  double duration_s_ = 0;
  bool moving_ = false;
  bool running_ = false;
  bool connected_ = true;
  hal::ArmSafety safety_ = hal::ArmSafety::kNormal;
  std::optional<Fault> refusal_;
  std::uint32_t number_ = 0;
  hal::ArmCounters counters_;
};

}  // namespace firstlook::mock
