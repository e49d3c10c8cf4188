#include "hal/sim/ur_controller/happenings.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace firstlook::sim::ur {
namespace {

struct Row {
  std::string_view word;
  bool takes_value;
  double low, high;  ///< of the value
  std::string_view meaning;
  Happening::Do act;
  Happening::Enter enter = nullptr;  ///< takes a text
};

constexpr double kNone = 0;

// Buttons of the pendant, safety inputs, faults, network.
constexpr Row kRows[] = {
    {"play", false, kNone, kNone,
     "Play: closes a popup, goes on, or begins; loads external_control.urp where nothing is loaded",
     [](SimulatedUr& r, double) { press_play(r); }},
    {"pause", false, kNone, kNone, "Pause", [](SimulatedUr& r, double) { static_cast<void>(r.programs().pause()); }},
    {"stop", false, kNone, kNone, "Stop", [](SimulatedUr& r, double) { static_cast<void>(r.programs().stop()); }},
    {"answer", false, kNone, kNone, "somebody fills in the dialog in which a program asks: True, 5, 2.5 or a text",
     nullptr, [](SimulatedUr& r, std::string_view text) { return r.controller().requests().enter(text); }},
    {"slider", true, 0, 1, "the speed slider is set, 0 to 1",
     [](SimulatedUr& r, double fraction) { r.controller().set_speed_slider(fraction); }},
    {"emergency-stop", false, kNone, kNone, "the button on the pendant: the power is off",
     [](SimulatedUr& r, double) { r.controller().emergency_stop(true); }},
    {"system-emergency-stop", false, kNone, kNone, "the same by the safety inputs",
     [](SimulatedUr& r, double) { r.controller().emergency_stop(true, SafetyMode::kSystemEmergencyStop); }},
    {"release-emergency-stop", false, kNone, kNone, "the button is out again; then: power on, brake release",
     [](SimulatedUr& r, double) { r.controller().emergency_stop(false); }},
    {"open-safeguard", false, kNone, kNone, "the gate is opened: the program is paused",
     [](SimulatedUr& r, double) { r.controller().safeguard(true); }},
    {"close-safeguard", false, kNone, kNone, "the gate is closed: a program that played goes on",
     [](SimulatedUr& r, double) { r.controller().safeguard(false); }},
    {"protective-stop", false, kNone, kNone, "the arm has felt a contact: the program ends; then, after 5 s: unlock",
     [](SimulatedUr& r, double) { r.controller().protective_stop("somebody asked for it"); }},
    {"protective-stop-paused", false, kNone, kNone, "the same, and the program is paused",
     [](SimulatedUr& r, double) {
       r.controller().protective_stop("somebody asked for it", Controller::Program::kPauses);
     }},
    {"safety-violation", false, kNone, kNone, "the safety system stops the robot; then: restart safety",
     [](SimulatedUr& r, double) { r.controller().safety_error(SafetyMode::kViolation); }},
    {"safety-fault", false, kNone, kNone, "the same for a fault",
     [](SimulatedUr& r, double) { r.controller().safety_error(SafetyMode::kFault); }},
    {"reduced-mode", false, kNone, kNone, "reduced safety limits, by an input or a plane",
     [](SimulatedUr& r, double) { r.controller().set_limits(SafetyMode::kReduced); }},
    {"recovery-mode", false, kNone, kNone, "the arm is outside of its limits: nothing plays",
     [](SimulatedUr& r, double) { r.controller().set_limits(SafetyMode::kRecovery); }},
    {"normal-mode", false, kNone, kNone, "back from either",
     [](SimulatedUr& r, double) { r.controller().set_limits(SafetyMode::kNormal); }},
    {"local-control", false, kNone, kNone, "an e-Series is switched to local control",
     [](SimulatedUr& r, double) { r.set_remote_control(false); }},
    {"remote-control", false, kNone, kNone, "and to remote control",
     [](SimulatedUr& r, double) { r.set_remote_control(true); }},
    {"power-off", false, kNone, kNone, "the arm's power is switched off",
     [](SimulatedUr& r, double) { r.controller().power_off(); }},
    {"reboot", false, kNone, kNone, "the controller is switched off and on: 10 s without an answer, a clock from 0",
     [](SimulatedUr& r, double) { r.reboot(); }},
    {"clock", true, -1e6, 1e6, "the controller's clock leaps by so many seconds",
     [](SimulatedUr& r, double by_s) { r.controller().set_clock_forward(by_s); }},
    {"unplug", false, kNone, kNone, "the network cable is out: nobody is told, nothing arrives",
     [](SimulatedUr& r, double) { r.plug(false); }},
    {"plug", false, kNone, kNone, "it is in again", [](SimulatedUr& r, double) { r.plug(true); }},
};

bool read_number(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
}

const Row& row_of(std::string_view word) {
  for (const Row& row : kRows) {
    if (row.word == word) return row;
  }
  return kRows[0];
}

std::string_view word_of(ControllerAction action) {
  switch (action) {
    case ControllerAction::kPlay:
      return "play";
    case ControllerAction::kPause:
      return "pause";
    case ControllerAction::kStop:
      return "stop";
    case ControllerAction::kProtectiveStop:
      return "protective-stop";
    case ControllerAction::kEmergencyStop:
      return "emergency-stop";
    case ControllerAction::kLinkLost:
      return "unplug";
  }
  return {};
}

}  // namespace

Result<Happening> read_happening(std::string_view words) {
  const std::size_t equals = words.find('=');
  const std::string_view word = words.substr(0, equals);
  for (const Row& row : kRows) {
    if (row.word != word) continue;
    Happening happening{row.act, 0, row.enter};
    if (row.enter != nullptr) {
      if (equals == std::string_view::npos) return failure(Fault::kUsage, "'{}': {} takes a text", words, row.word);
      happening.text = words.substr(equals + 1);
      return happening;
    }
    if (!row.takes_value && equals == std::string_view::npos) return happening;
    const bool right = row.takes_value && equals != std::string_view::npos &&
                       read_number(words.substr(equals + 1), happening.value) && happening.value >= row.low &&
                       happening.value <= row.high;
    if (right) return happening;
    if (!row.takes_value) return failure(Fault::kUsage, "'{}': {} takes no value", words, row.word);
    return failure(Fault::kUsage, "'{}': {} takes a number from {} to {}", words, row.word, row.low, row.high);
  }
  return failure(Fault::kUsage,
                 "'{}' is nothing that can happen to a robot; `firstlook ur-sim --at help` tells what is", words);
}

bool happen(const Happening& happening, SimulatedUr& robot) {
  if (happening.act != nullptr) happening.act(robot, happening.value);
  return happening.enter == nullptr || happening.enter(robot, happening.text);
}

std::string happenings_in_words() {
  std::string text;
  for (const Row& row : kRows) {
    const std::string_view value = row.takes_value ? "=NUMBER" : row.enter != nullptr ? "=TEXT" : "";
    text += fmt::format("  {:24} {}\n", fmt::format("{}{}", row.word, value), row.meaning);
  }
  return text;
}

Result<TimedHappening> read_timed_happening(std::string_view words) {
  const std::size_t equals = words.find('=');
  double at_s = -1;
  if (equals == std::string_view::npos || !read_number(words.substr(0, equals), at_s) || at_s < 0 || at_s > 1e6) {
    return failure(Fault::kUsage, "'{}': write SECONDS=WHAT, such as 20=emergency-stop", words);
  }
  const auto happening = read_happening(words.substr(equals + 1));
  if (!happening) return std::unexpected(happening.error());
  return TimedHappening{Instant{seconds(at_s).ns}, *happening};
}

Timetable timetable_of(const ControllerScript& script) {
  Timetable table;
  for (const sim::ControllerEvent& event : script) {
    table.push_back({event.stamp, {.act = row_of(word_of(event.action)).act}});
  }
  return table;
}

void press_play(SimulatedUr& robot) {
  constexpr std::string_view kProgram = "external_control.urp";
  Programs& programs = robot.programs();
  const bool goes_on = robot.controller().state().runtime == RuntimeState::kPaused;
  robot.controller().close_popup();  // who presses Play has read it
  if (!goes_on && programs.loaded_path().empty() && !programs.load(kProgram)) return;
  static_cast<void>(programs.play());
}

}  // namespace firstlook::sim::ur
