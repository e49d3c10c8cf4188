/// The UR driver with a simulated controller behind it, both in virtual time; and somebody at its pendant.
#pragma once

#include <catch2/catch.hpp>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hal/ur/ur_robot.hpp"
#include "tests/support/ur_memory_network.hpp"
#include "tests/support/ur_robot.hpp"

namespace firstlook::test {

/// As a RobotArm it runs the controller up to each call's time, and does at their times what was asked for.
class DrivenUr final : public hal::RobotArm {
 public:
  explicit DrivenUr(const char* model, ur::NoticeSink* notices = nullptr)
      : ur(model, true, {{"external_control.urp", "", {"firstlook", UrMemoryNetwork::kProgramPort}}}),
        network(ur.robot),
        robot(network, {model, "firstlook", UrMemoryNetwork::kControlPort}, notices) {
    REQUIRE(ur.dashboard("load external_control.urp").starts_with("Loading program"));
  }

  void at(Instant when, std::function<void(DrivenUr&)> what) { script_[when] = std::move(what); }
  void play() { REQUIRE(ur.robot.programs().play()); }

  /// Lets time pass in steps of the driver's own; what is reported is kept for poll().
  void run_to(Instant now) {
    while (time_ < now) {
      time_ = std::min(time_ + ur::UrRobot::kPoll, now);
      while (!script_.empty() && script_.begin()->first <= time_) {
        const auto what = std::move(script_.begin()->second);
        script_.erase(script_.begin());
        what(*this);
      }
      network.advance(time_);
      while (const auto state = robot.poll(time_)) {
        states_.push_back(*state);
        last = *state;
        ++reported;
      }
      while (const auto key = robot.pendant().poll(time_)) keys.push_back(key->action);
    }
  }
  void run(double s) { run_to(time_ + seconds(s)); }
  [[nodiscard]] Instant now() const { return time_; }

  // hal::RobotArm
  [[nodiscard]] const char* model() const override { return robot.model(); }
  [[nodiscard]] std::optional<hal::ArmState> poll(Instant now) override {
    run_to(now);
    if (states_.empty()) return std::nullopt;
    const hal::ArmState state = states_.front();
    states_.erase(states_.begin());
    ++polled_;
    return state;
  }
  [[nodiscard]] Instant next_due() const override { return states_.empty() ? time_ + ur::UrRobot::kPoll : time_; }
  [[nodiscard]] Status move(const hal::Segment& segment, Instant now) override {
    run_to(now);
    return robot.move(segment, time_);
  }
  void stop(Instant now) override {
    run_to(now);
    robot.stop(time_);
  }
  [[nodiscard]] hal::ArmCounters counters() const override {
    hal::ArmCounters counters = robot.counters();
    counters.states = polled_;
    return counters;
  }

  test::UrRobot ur;
  UrMemoryNetwork network;
  ur::UrRobot robot;
  hal::ArmState last;
  std::uint64_t reported = 0;
  std::vector<hal::OperatorAction> keys;

 private:
  Instant time_{};
  std::map<Instant, std::function<void(DrivenUr&)>> script_;
  std::vector<hal::ArmState> states_;
  std::uint64_t polled_ = 0;
};

}  // namespace firstlook::test
