/// Watchdogs that a program sets over inputs of RTDE clients (`rtde_set_watchdog`): what is done when one of them is
/// not renewed in time.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace firstlook::sim::ur {

class RtdeWatchdogs {
 public:
  enum class Action : std::uint8_t { kIgnore, kPause, kStop };
  using Variable = std::pair<int, int>;  ///< row and index of an input's name

  /// From cycle `now` on; one for each variable.
  void set(const Variable& variable, std::uint64_t period_cycles, Action action, std::uint64_t now) {
    std::erase_if(watched_, [&](const Watched& watched) { return watched.variable == variable; });
    watched_.push_back({variable, period_cycles, action, now});
  }
  /// A client has sent the variable.
  void renew(const Variable& variable, std::uint64_t now) {
    for (Watched& watched : watched_) {
      if (watched.variable == variable) watched.renewed = now;
    }
  }
  /// The program does not run in this cycle: nothing is late because of it.
  void hold(std::uint64_t now) {
    for (Watched& watched : watched_) watched.renewed = now;
  }
  /// With the program.
  void clear() { watched_.clear(); }
  /// What the first asks for whose time is over; its next period begins.
  [[nodiscard]] std::optional<Action> late(std::uint64_t now) {
    for (Watched& watched : watched_) {
      if (now - watched.renewed <= watched.period_cycles) continue;
      watched.renewed = now;
      return watched.action;
    }
    return std::nullopt;
  }

 private:
  struct Watched {
    Variable variable;
    std::uint64_t period_cycles = 0;
    Action action = Action::kPause;
    std::uint64_t renewed = 0;
  };
  std::vector<Watched> watched_;
};

}  // namespace firstlook::sim::ur
