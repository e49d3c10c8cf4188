/// What a person uses: the robot's pendant and the panel with buttons and lights on the cart.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "platform/core/time.hpp"

namespace firstlook::hal {

enum class OperatorAction : std::uint8_t {
  kPlay,
  kPause,
  kStop,
  kConfirm,
  kLost,  ///< nobody pressed anything: the device is gone, and nobody could hear its stop any more
};

struct OperatorEvent {
  Instant stamp{};
  OperatorAction action = OperatorAction::kPlay;
};

/// The teach pendant: its program keys, and one line of text for progress. Non-blocking, loop thread.
class Pendant {
 public:
  virtual ~Pendant() = default;
  [[nodiscard]] virtual std::optional<OperatorEvent> poll(Instant now) = 0;
  [[nodiscard]] virtual Instant next_due() const = 0;
  virtual void show(std::string_view line) = 0;
};

enum class Light : std::uint8_t { kOff, kGreen, kAmber, kRed };

/// Buttons and tower light of the cart. Non-blocking, loop thread.
class Panel {
 public:
  virtual ~Panel() = default;
  [[nodiscard]] virtual std::optional<OperatorEvent> poll(Instant now) = 0;
  [[nodiscard]] virtual Instant next_due() const = 0;
  virtual void light(Light light) = 0;
};

}  // namespace firstlook::hal
