/// The driver of a UR robot on a controller whose time its client keeps: its network, that time as a clock, the arm
/// that lets it pass, and the pendant.
#pragma once

#include <algorithm>

#include "hal/api/operator_devices.hpp"
#include "hal/api/robot_arm.hpp"
#include "hal/sim/ur_controller/stepped_links.hpp"
#include "hal/ur/network.hpp"
#include "platform/loop/clock.hpp"

namespace firstlook {

class SteppedNetwork final : public ur::Network {
 public:
  /// @param links  outlive this
  SteppedNetwork(sim::ur::SteppedLinks& links, std::uint16_t program_port, std::uint16_t control_port)
      : links_(links), program_port_(program_port), control_port_(control_port) {}

  [[nodiscard]] ur::LinkId dial(ur::Service service) override { return links_.dial(port_of(service)); }
  [[nodiscard]] ur::LinkId accept(ur::Door door) override {
    return links_.accept(door == ur::Door::kProgram ? program_port_ : control_port_);
  }
  [[nodiscard]] ur::LinkState state(ur::LinkId link) override {
    switch (links_.state(link)) {
      case sim::ur::SteppedLinks::State::kConnecting:
        return ur::LinkState::kConnecting;
      case sim::ur::SteppedLinks::State::kOpen:
        return ur::LinkState::kOpen;
      case sim::ur::SteppedLinks::State::kClosed:
        break;
    }
    return ur::LinkState::kClosed;
  }
  [[nodiscard]] std::string_view receive(ur::LinkId link, std::span<char> room) override {
    return links_.receive(link, room);
  }
  bool send(ur::LinkId link, std::string_view bytes) override { return links_.send(link, bytes); }
  void close(ur::LinkId link) override { links_.close(link); }

 private:
  static sim::ur::Port port_of(ur::Service service) {
    switch (service) {
      case ur::Service::kDashboard:
        return sim::ur::Port::kDashboard;
      case ur::Service::kPrimary:
        return sim::ur::Port::kPrimary;
      case ur::Service::kRtde:
        break;
    }
    return sim::ur::Port::kRtde;
  }

  sim::ur::SteppedLinks& links_;
  std::uint16_t program_port_, control_port_;
};

/// Before the job: the robot's time goes on while somebody waits.
class SteppedClock final : public Clock {
 public:
  explicit SteppedClock(sim::ur::SteppedLinks& links) : links_(links) {}
  [[nodiscard]] Instant now() const override { return links_.now(); }
  void sleep_until(Instant until) override { links_.step_to(until); }
  void wake() noexcept override {}
  [[nodiscard]] bool is_virtual() const override { return true; }

 private:
  sim::ur::SteppedLinks& links_;
};

/// When a device of the driver is to be looked at: it asks as one on a network, where something may come at any time.
[[nodiscard]] inline Instant due_in_steps(Instant asked, const sim::ur::SteppedLinks& links) {
  return asked > links.now() ? std::max(asked, links.next_cycle()) : asked;
}

/// The driver's arm; each look at it lets the robot run up to then.
class SteppedArm final : public hal::RobotArm {
 public:
  SteppedArm(sim::ur::SteppedLinks& links, hal::RobotArm& driver) : links_(links), driver_(driver) {}
  [[nodiscard]] const char* model() const override { return driver_.model(); }
  [[nodiscard]] std::optional<hal::ArmState> poll(Instant now) override {
    links_.step_to(now);
    return driver_.poll(now);
  }
  [[nodiscard]] Instant next_due() const override { return due_in_steps(driver_.next_due(), links_); }
  [[nodiscard]] Status move(const hal::Segment& segment, Instant now) override { return driver_.move(segment, now); }
  void stop(Instant now) override { driver_.stop(now); }
  [[nodiscard]] hal::ArmCounters counters() const override { return driver_.counters(); }

 private:
  sim::ur::SteppedLinks& links_;
  hal::RobotArm& driver_;
};

class SteppedPendant final : public hal::Pendant {
 public:
  SteppedPendant(sim::ur::SteppedLinks& links, hal::Pendant& driver) : links_(links), driver_(driver) {}
  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now) override { return driver_.poll(now); }
  [[nodiscard]] Instant next_due() const override { return due_in_steps(driver_.next_due(), links_); }
  void show(std::string_view line) override { driver_.show(line); }

 private:
  sim::ur::SteppedLinks& links_;
  hal::Pendant& driver_;
};

}  // namespace firstlook
