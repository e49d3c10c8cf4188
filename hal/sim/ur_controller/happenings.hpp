/// What people and mishaps do to a simulated robot, in words: for a console, a port of its own, a timetable, and
/// faults.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "hal/sim/simulated_arm.hpp"
#include "hal/sim/ur_controller/simulated_ur.hpp"
#include "platform/core/result.hpp"
#include "platform/core/time.hpp"

namespace firstlook::sim::ur {

/// One of the things that happen; read from its words.
struct Happening {
  using Do = void (*)(SimulatedUr&, double);
  using Enter = bool (*)(SimulatedUr&, std::string_view);
  Do act = nullptr;
  double value = 0;  ///< of those that take one
  Enter enter = nullptr;
  std::string text{};  ///< of those that take one instead
};

/// "emergency-stop", "slider=0.5", ... Error: kUsage, with the words that there are.
[[nodiscard]] Result<Happening> read_happening(std::string_view words);
/// False when nobody asked for the text.
bool happen(const Happening& happening, SimulatedUr& robot);
/// All words with what they do, a line each.
[[nodiscard]] std::string happenings_in_words();

/// What happens at which time since the service began, or the job in lockstep.
struct TimedHappening {
  Instant stamp{};
  Happening happening;
};
using Timetable = std::vector<TimedHappening>;
/// "20=emergency-stop" or "20.5=slider=0.5": seconds, then words. Error: kUsage.
[[nodiscard]] Result<TimedHappening> read_timed_happening(std::string_view words);
/// What a simulated cell's script does to its arm, as it happens to a controller.
[[nodiscard]] Timetable timetable_of(const ControllerScript& script);

/// Somebody presses Play: on external_control.urp, where nothing else is loaded.
void press_play(SimulatedUr& robot);

}  // namespace firstlook::sim::ur
