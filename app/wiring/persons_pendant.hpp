/// The pendant of a robot that moves a simulated cell's arm, in the hands of the cell's person.
#pragma once

#include <algorithm>

#include "hal/api/operator_devices.hpp"

namespace firstlook {

/// Its keys are the robot's. Its lines are read by the person, too, who does what they ask for and confirms; a UR
/// pendant has no key for that, a cart has a button.
class PersonsPendant final : public hal::Pendant {
 public:
  /// @param person  the cell's own pendant. Both outlive this
  PersonsPendant(hal::Pendant& robot, hal::Pendant& person) : robot_(robot), person_(person) {}
  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now) override {
    const auto key = robot_.poll(now);
    return key ? key : person_.poll(now);
  }
  [[nodiscard]] Instant next_due() const override { return std::min(robot_.next_due(), person_.next_due()); }
  void show(std::string_view line) override {
    robot_.show(line);
    person_.show(line);
  }

 private:
  hal::Pendant& robot_;
  hal::Pendant& person_;
};

}  // namespace firstlook
