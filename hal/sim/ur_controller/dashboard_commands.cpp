#include "hal/sim/ur_controller/dashboard_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <utility>

namespace firstlook::sim::ur {
namespace {

using Argument = std::string_view;
using Run = std::string (*)(DashboardSession&, Argument);

constexpr SoftwareVersion kNever{99};

/// The version in each generation from which a command is there.
struct Command {
  std::string_view words;
  SoftwareVersion cb3, e_series;
  bool takes_argument;
  Run run;
};

constexpr std::string_view kInstallation = "default.installation";

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

std::string failed(std::string_view command) { return fmt::format("Failed to execute: {}", command); }

std::string load(DashboardSession& s, Argument name) {
  return fmt::format("{}: {}", s.programs().load(name) ? "Loading program" : "File not found", name);
}

std::string load_installation(DashboardSession&, Argument name) {
  return fmt::format("{}: {}", name.ends_with(kInstallation) ? "Loading installation" : "File not found", name);
}

// Since 3.3 these three are answered when it has happened.
std::string play(DashboardSession& s, Argument) {
  if (!s.programs().play()) return failed("play");
  s.answer_when([](DashboardSession& session) -> std::optional<std::string> {
    if (session.programs().starting()) return std::nullopt;
    return session.programs().start_failed() ? failed("play") : "Starting program";
  });
  return {};
}

std::string stop(DashboardSession& s, Argument) {
  if (!s.programs().stop()) return failed("stop");
  s.answer_when([](DashboardSession& session) -> std::optional<std::string> {
    if (session.controller().state().program_running()) return std::nullopt;
    return "Stopped";
  });
  return {};
}

std::string pause(DashboardSession& s, Argument) {
  if (!s.programs().pause()) return failed("pause");
  s.answer_when([](DashboardSession& session) -> std::optional<std::string> {
    if (session.controller().state().runtime == RuntimeState::kPausing) return std::nullopt;
    return "Pausing program";
  });
  return {};
}

std::string quit(DashboardSession& s, Argument) {
  s.disconnect();
  return "Disconnected";
}

std::string shutdown(DashboardSession& s, Argument) {
  s.dashboard().shutting_down = true;
  return "Shutting down";
}

std::string running(DashboardSession& s, Argument) {
  return fmt::format("Program running: {}", s.controller().state().program_running());
}

std::string robotmode(DashboardSession& s, Argument) {
  return fmt::format("Robotmode: {}", name_of(s.controller().state().robot_mode));
}

std::string loaded_program(DashboardSession& s, Argument) {
  const std::string path = s.programs().loaded_path();
  return path.empty() ? "No program loaded" : "Loaded program: " + path;
}

std::string program_state(DashboardSession& s, Argument) {
  const RuntimeState runtime = s.controller().state().runtime;
  const bool paused = runtime == RuntimeState::kPaused || runtime == RuntimeState::kPausing;
  const bool stopped = runtime == RuntimeState::kStopped || runtime == RuntimeState::kStopping;
  return fmt::format("{} {}", paused ? "PAUSED" : stopped ? "STOPPED" : "PLAYING", s.programs().loaded_name());
}

std::string is_program_saved(DashboardSession& s, Argument) {
  return fmt::format("true {}", s.programs().loaded_name());
}

std::string popup(DashboardSession&, Argument) { return "showing popup"; }

std::string close_popup(DashboardSession& s, Argument) {
  s.controller().close_popup();
  return "closing popup";
}

std::string close_safety_popup(DashboardSession&, Argument) { return "closing safety popup"; }

std::string add_to_log(DashboardSession& s, Argument text) {
  if (text.empty()) return "No log message to add";
  s.controller().tell({.kind = ControllerEvent::Kind::kText, .text = std::string(text)});
  return "Added log message";
}

std::string polyscope_version(DashboardSession& s, Argument) {
  const ControllerIdentity& identity = s.controller().identity();
  return fmt::format("URSoftware {} ({})", identity.version_text(), identity.build_date);
}

std::string version(DashboardSession& s, Argument) { return s.controller().identity().version_text(); }
std::string robot_model(DashboardSession& s, Argument) { return std::string(s.controller().identity().model); }
std::string serial_number(DashboardSession& s, Argument) { return s.controller().identity().serial; }
std::string is_in_remote_control(DashboardSession& s, Argument) {
  return s.dashboard().remote_control ? "true" : "false";
}

std::string power_on(DashboardSession& s, Argument) {
  s.controller().power_on();
  return "Powering on";
}

std::string power_off(DashboardSession& s, Argument) {
  s.controller().power_off();
  return "Powering off";
}

std::string brake_release(DashboardSession& s, Argument) {
  s.controller().release_brakes();
  return "Brake releasing";
}

std::string unlock_protective_stop(DashboardSession& s, Argument) {
  return s.controller().unlock_protective_stop() ? "Protective stop releasing"
                                                 : "Cannot unlock protective stop until 5s after occurrence. Always "
                                                   "inspect cause of protective stop before "
                                                   "unlocking";
}

std::string restart_safety(DashboardSession& s, Argument) {
  s.controller().restart_safety();
  return "Restarting safety";
}

std::string safetymode(DashboardSession& s, Argument) {
  return fmt::format("Safetymode: {}", name_of(s.controller().state().safety_mode));
}

std::string safetystatus(DashboardSession& s, Argument) {
  return fmt::format("Safetystatus: {}", name_of(s.controller().state().safety_mode));
}

std::string set_operational_mode(DashboardSession& s, Argument mode) {
  const std::string wanted = lower(mode);
  if (wanted != "manual" && wanted != "automatic") return fmt::format("Failed setting operational mode: {}", mode);
  s.dashboard().operational_mode = wanted == "manual" ? "MANUAL" : "AUTOMATIC";
  return fmt::format("Operational mode {} is set", mode);
}

std::string get_operational_mode(DashboardSession& s, Argument) { return s.dashboard().operational_mode; }

std::string clear_operational_mode(DashboardSession& s, Argument) {
  const std::string mode = std::exchange(s.dashboard().operational_mode, "NONE");
  return fmt::format("No longer controlling the operational mode. Current operational mode: '{}'.",
                     mode == "NONE" ? "MANUAL" : mode);
}

std::string set_user_role(DashboardSession& s, Argument role) {
  constexpr std::string_view kRoles[] = {"programmer", "operator", "none", "locked", "restricted"};
  const std::string wanted = lower(role);
  if (std::ranges::find(kRoles, wanted) == std::end(kRoles)) return fmt::format("Failed setting user role: {}", role);
  s.dashboard().user_role = wanted;
  std::ranges::transform(wanted, s.dashboard().user_role.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return fmt::format("Setting user role: {}", role);
}

std::string get_user_role(DashboardSession& s, Argument) { return s.dashboard().user_role; }

std::string flight_report(DashboardSession& s, Argument kind) {
  const std::string wanted = lower(kind);
  if (!wanted.empty() && wanted != "controller" && wanted != "software" && wanted != "system") {
    return fmt::format("Error: no report type '{}'", kind);
  }
  return fmt::format("Flight Report generated with id: {}", ++s.dashboard().flight_reports);
}

std::string support_file(DashboardSession& s, Argument folder) {
  return fmt::format("Completed successfully: {}/ur_{}.zip", folder, s.controller().identity().serial);
}

std::string save_log(DashboardSession&, Argument) { return "Log saved to disk"; }

// Longer words stand before their beginnings.
constexpr Command kCommands[] = {
    {"load installation", {3, 2}, {5, 0}, true, load_installation},
    {"load", {1, 4}, {5, 0}, true, load},
    {"play", {1, 4}, {5, 0}, false, play},
    {"stop", {1, 4}, {5, 0}, false, stop},
    {"pause", {1, 4}, {5, 0}, false, pause},
    {"quit", {1, 4}, {5, 0}, false, quit},
    {"shutdown", {1, 4}, {5, 0}, false, shutdown},
    {"running", {1, 6}, {5, 0}, false, running},
    {"robotmode", {1, 6}, {5, 0}, false, robotmode},
    {"get loaded program", {1, 6}, {5, 0}, false, loaded_program},
    {"popup", {1, 6}, {5, 0}, true, popup},
    {"close popup", {1, 6}, {5, 0}, false, close_popup},
    {"addtolog", {1, 8}, {5, 0}, true, add_to_log},
    {"isprogramsaved", {1, 8}, {5, 0}, false, is_program_saved},
    {"programstate", {1, 8}, {5, 0}, false, program_state},
    {"polyscopeversion", {1, 8}, {5, 0}, false, polyscope_version},
    {"version", kNever, {5, 0}, false, version},
    {"setuserrole", {3, 1}, kNever, true, set_user_role},
    {"getuserrole", {3, 1}, kNever, false, get_user_role},
    {"power on", {3, 0}, {5, 0}, false, power_on},
    {"power off", {3, 0}, {5, 0}, false, power_off},
    {"brake release", {3, 0}, {5, 0}, false, brake_release},
    {"safetymode", {3, 0}, {5, 0}, false, safetymode},
    {"safetystatus", kNever, {5, 4}, false, safetystatus},
    {"unlock protective stop", {3, 1}, {5, 0}, false, unlock_protective_stop},
    {"close safety popup", {3, 1}, {5, 0}, false, close_safety_popup},
    {"restart safety", {3, 7}, {5, 1}, false, restart_safety},
    {"set operational mode", kNever, {5, 0}, true, set_operational_mode},
    {"get operational mode", kNever, {5, 6}, false, get_operational_mode},
    {"clear operational mode", kNever, {5, 0}, false, clear_operational_mode},
    {"is in remote control", kNever, {5, 6}, false, is_in_remote_control},
    {"get serial number", {3, 12}, {5, 6}, false, serial_number},
    {"get robot model", {3, 12}, {5, 6}, false, robot_model},
    {"generate flight report", {3, 13}, {5, 8}, true, flight_report},
    {"generate support file", {3, 13}, {5, 8}, true, support_file},
    {"savelog", {3, 13}, {5, 8}, false, save_log},
};

bool matches(const Command& command, std::string_view lowered) {
  if (!command.takes_argument) return lowered == command.words;
  return lowered.starts_with(command.words) &&
         (lowered.size() == command.words.size() || lowered[command.words.size()] == ' ');
}

}  // namespace

std::string run_dashboard_command(std::string_view line, DashboardSession& session) {
  const ControllerIdentity& identity = session.controller().identity();
  const std::string lowered = lower(line);
  for (const Command& command : kCommands) {
    const SoftwareVersion& since = identity.series == Series::kCb3 ? command.cb3 : command.e_series;
    if (identity.version < since || !matches(command, lowered)) continue;
    std::string_view argument = line.substr(command.words.size());
    while (!argument.empty() && argument.front() == ' ') argument.remove_prefix(1);
    return command.run(session, argument);
  }
  return fmt::format("could not understand: '{}'", line);
}

}  // namespace firstlook::sim::ur
