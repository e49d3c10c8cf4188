#include "hal/sim/simulated_operator.hpp"

#include <algorithm>
#include <cmath>

namespace firstlook::sim {
namespace {

void press(OperatorScript& script, double at_s, hal::OperatorAction action) {
  if (std::isfinite(at_s)) script.push_back({Instant{seconds(at_s).ns}, action});
}

void happen(ControllerScript& script, double at_s, ControllerAction action) {
  if (std::isfinite(at_s)) script.push_back({Instant{seconds(at_s).ns}, action});
}

}  // namespace

OperatorScript pendant_script(const Faults& faults) {
  OperatorScript script;
  press(script, faults.play_s, hal::OperatorAction::kPlay);
  press(script, faults.pause_s, hal::OperatorAction::kPause);
  press(script, faults.pause_s + faults.pause_duration_s, hal::OperatorAction::kPlay);
  press(script, faults.stop_s, hal::OperatorAction::kStop);
  return script;
}

OperatorScript panel_script(const Faults& faults) {
  OperatorScript script;
  press(script, faults.start_s, hal::OperatorAction::kPlay);
  press(script, faults.panel_lost_s, hal::OperatorAction::kLost);
  return script;
}

ControllerScript controller_script(const Faults& faults) {
  ControllerScript script;
  happen(script, faults.play_s, ControllerAction::kPlay);
  happen(script, faults.pause_s, ControllerAction::kPause);
  happen(script, faults.pause_s + faults.pause_duration_s, ControllerAction::kPlay);
  happen(script, faults.stop_s, ControllerAction::kStop);
  happen(script, faults.protective_stop_s, ControllerAction::kProtectiveStop);
  happen(script, faults.emergency_stop_s, ControllerAction::kEmergencyStop);
  happen(script, faults.link_lost_s, ControllerAction::kLinkLost);
  return script;
}

ScriptedKeys::ScriptedKeys(const OperatorScript& script) : script_(script) {
  std::stable_sort(script_.begin(), script_.end(),
                   [](const hal::OperatorEvent& a, const hal::OperatorEvent& b) { return a.stamp < b.stamp; });
}

std::optional<hal::OperatorEvent> ScriptedKeys::poll(Instant now) {
  if (next_ == script_.size() || script_[next_].stamp > now) return std::nullopt;
  return script_[next_++];
}

Instant ScriptedKeys::next_due() const { return next_ == script_.size() ? kNeverDue : script_[next_].stamp; }

std::optional<hal::OperatorEvent> SimulatedPendant::poll(Instant now) {
  const auto key = keys_.poll(now);
  return key || hand_ == nullptr ? key : hand_->poll(now);
}

Instant SimulatedPendant::next_due() const {
  return hand_ == nullptr ? keys_.next_due() : std::min(keys_.next_due(), hand_->next_due());
}

void SimulatedPendant::show(std::string_view line) {
  if (hand_ != nullptr) hand_->read(line);
  length_ = std::min(line.size(), kLineMax);
  std::copy_n(line.begin(), length_, line_.begin());
  ++lines_;
}

}  // namespace firstlook::sim
