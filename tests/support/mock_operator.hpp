/// Scripted key presses, shared by the mocks of pendant and panel.
#pragma once

#include <algorithm>
#include <deque>
#include <optional>

#include "hal/api/operator_devices.hpp"

namespace firstlook::mock {

/// Presses in order of time.
class ScriptedPresses {
 public:
  void press(Instant stamp, hal::OperatorAction action) {
    presses_.push_back({stamp, action});
    std::stable_sort(presses_.begin(), presses_.end(),
                     [](const hal::OperatorEvent& a, const hal::OperatorEvent& b) { return a.stamp < b.stamp; });
  }
  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now) {
    if (presses_.empty() || presses_.front().stamp > now) return std::nullopt;
    const hal::OperatorEvent event = presses_.front();
    presses_.pop_front();
    return event;
  }
  [[nodiscard]] Instant next_due() const { return presses_.empty() ? Instant{INT64_MAX / 2} : presses_.front().stamp; }

 private:
  std::deque<hal::OperatorEvent> presses_;
};

}  // namespace firstlook::mock
