#include "app/wiring/simulated_ur.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>

#include "app/cli/exit_codes.hpp"
#include "hal/sim/cell_file.hpp"
#include "hal/sim/ur_controller/tcp_service.hpp"
#include "platform/linux/files.hpp"
#include "platform/linux/process.hpp"

namespace firstlook {
namespace {

/// HOST or HOST:PORT; without one the port of the External Control URCap.
Result<sim::ur::ExternalControl> external_control_of(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  int port = 50002;
  if (colon != std::string::npos) {
    const auto [end, error] = std::from_chars(text.data() + colon + 1, text.data() + text.size(), port);
    if (error != std::errc{} || end != text.data() + text.size() || port < 1 || port > 65535) {
      return failure(Fault::kUsage, "--external-control {}: no port after the colon", text);
    }
  }
  return sim::ur::ExternalControl{text.substr(0, colon), static_cast<std::uint16_t>(port)};
}

}  // namespace

Result<std::unique_ptr<sim::ur::SimulatedUr>> make_simulated_ur(const UrSimCommand& command, const sim::Scene* scene) {
  sim::ur::SimulatedUrOptions options;
  std::string model = command.model;
  if (scene != nullptr) {
    if (!scene->arm_file.empty()) {
      return failure(Fault::kUsage, "the arm of {} is read from {}: no controller is simulated for it", scene->name,
                     scene->arm_file);
    }
    model = scene->arm.name.view();
    options.start_rad = scene->start_rad;
    options.encoder_sigma_rad = sim::kEncoderSigma_rad;
    options.encoder_seed = command.seed;
    options.remote_control = false;  // somebody stands at its pendant
  }
  const auto identity = sim::ur::identify_controller(model, scene ? scene->robot : command.seed, command.serial);
  if (!identity && scene != nullptr)
    return failure(identity.error().fault, "the arm of {}: {}", scene->name, identity.error().detail());
  if (!identity) return std::unexpected(identity.error());
  const bool somebody_plays = command.play_after_s >= 0 || command.lockstep;
  options.running = command.running || somebody_plays;
  for (const std::string& path : command.programs) {
    const Result<std::string> script = read_text_file(path, sim::ur::kScriptBytesMax);
    if (!script) return std::unexpected(script.error());
    options.programs.push_back({std::filesystem::path(path).stem().string() + ".urp", *script, {}});
  }
  std::string asked = command.external_control;
  if (asked.empty() && somebody_plays) asked = "127.0.0.1";
  if (!asked.empty()) {
    const auto external = external_control_of(asked);
    if (!external) return std::unexpected(external.error());
    options.programs.push_back({"external_control.urp", "", *external});
  }
  return std::make_unique<sim::ur::SimulatedUr>(*identity, options);
}

int run_ur_sim(const UrSimCommand& command) {
  if (std::ranges::find(command.happens, "help") != command.happens.end()) {
    std::printf("%s", sim::ur::happenings_in_words().c_str());
    return kExitDone;
  }
  std::optional<sim::Scene> scene;
  if (!command.cell.empty()) {
    auto loaded = sim::load_cell(command.cell, command.seed);
    if (!loaded) return fail(loaded.error());
    scene = std::move(*loaded);
  }
  const auto robot = make_simulated_ur(command, scene ? &*scene : nullptr);
  if (!robot) return fail(robot.error());
  constexpr double kPlay_s = 0.5;  // as the operator of a simulated cell
  const double play_after_s = command.lockstep && command.play_after_s < 0 ? kPlay_s : command.play_after_s;
  sim::ur::Timetable timetable;
  for (const std::string& words : command.happens) {
    const auto happening = sim::ur::read_timed_happening(words);
    if (!happening) return fail(failure(happening.error().fault, "--at {}", happening.error().detail()).error());
    timetable.push_back(*happening);
  }
  catch_stop_signals();
  const Status served = sim::ur::serve_on_tcp(**robot, {command.host, command.port_offset, !command.cell.empty(),
                                                        play_after_s, command.lockstep, timetable, command.console});
  if (served) return kExitDone;
  std::fprintf(
      stderr,
      "firstlook: E%d %s\n      Give --host an address of this computer; a port that is taken: end the program "
      "that has it, or choose another --port-offset. Ports below 1024 need root.\n",
      static_cast<int>(served.error().fault), std::string(served.error().detail()).c_str());
  return exit_code_of(served.error());
}

}  // namespace firstlook
