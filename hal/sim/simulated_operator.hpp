/// The person beside the cart: presses keys by a script and reads what the cart shows.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "hal/api/operator_devices.hpp"
#include "hal/sim/faults.hpp"
#include "hal/sim/simulated_arm.hpp"
#include "hal/sim/touching_hand.hpp"
#include "platform/core/fixed_vector.hpp"

namespace firstlook::sim {

using OperatorScript = FixedVector<hal::OperatorEvent, 16>;

/// What the script does to the pendant's keys: Play, and the pause or stop that the faults ask for.
[[nodiscard]] OperatorScript pendant_script(const Faults& faults);
/// The button on the panel, and the end of the panel.
[[nodiscard]] OperatorScript panel_script(const Faults& faults);
/// The same keys as the robot's controller feels them, and its mishaps.
[[nodiscard]] ControllerScript controller_script(const Faults& faults);

/// A person's key presses in order of time.
class ScriptedKeys {
 public:
  explicit ScriptedKeys(const OperatorScript& script);
  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now);
  [[nodiscard]] Instant next_due() const;

 private:
  OperatorScript script_;
  std::size_t next_ = 0;
};

class SimulatedPendant final : public hal::Pendant {
 public:
  static constexpr std::size_t kLineMax = 120;  // longer lines are cut, as a pendant's display does

  /// @param hand  does what the lines ask for and confirms it; may be null. Must outlive the pendant
  explicit SimulatedPendant(const OperatorScript& script, TouchingHand* hand = nullptr) : keys_(script), hand_(hand) {}
  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now) override;
  [[nodiscard]] Instant next_due() const override;
  void show(std::string_view line) override;

  [[nodiscard]] std::string_view shown() const { return {line_.data(), length_}; }
  [[nodiscard]] std::uint64_t lines_shown() const { return lines_; }

 private:
  ScriptedKeys keys_;
  TouchingHand* hand_;
  std::array<char, kLineMax> line_{};
  std::size_t length_ = 0;
  std::uint64_t lines_ = 0;
};

class SimulatedPanel final : public hal::Panel {
 public:
  explicit SimulatedPanel(const OperatorScript& script) : keys_(script) {}
  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now) override { return keys_.poll(now); }
  [[nodiscard]] Instant next_due() const override { return keys_.next_due(); }
  void light(hal::Light light) override { lit_ = light; }

  [[nodiscard]] hal::Light lit() const { return lit_; }

 private:
  ScriptedKeys keys_;
  hal::Light lit_ = hal::Light::kOff;
};

}  // namespace firstlook::sim
