/// When a sensor that gives no frames, although it was opened again and again, is reset.
#pragma once

#include <optional>

#include "platform/core/time.hpp"

namespace firstlook::hal {

/// Not before it was silent for `patience`, each time after twice as long, `resets_max` times. One that gives frames
/// again starts anew.
class LastResort {
 public:
  explicit LastResort(Duration patience = milliseconds(15000), int resets_max = 3)
      : patience_(patience), resets_max_(resets_max) {}
  void frame_came() {
    silent_since_.reset();
    resets_ = 0;
  }
  /// Whether now is the time for a reset; to be asked while no frames come. The silence begins with the first question.
  [[nodiscard]] bool due(Instant now) {
    if (!silent_since_) silent_since_ = now;
    if (resets_ >= resets_max_ || now - *silent_since_ < Duration{patience_.ns << resets_}) return false;
    silent_since_ = now;
    ++resets_;
    return true;
  }
  [[nodiscard]] int resets() const { return resets_; }

 private:
  Duration patience_;
  int resets_max_;
  int resets_ = 0;
  std::optional<Instant> silent_since_;
};

}  // namespace firstlook::hal
