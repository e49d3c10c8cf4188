/// firstlook: from the command line to what each command does. With app/wiring the only place that names concrete
/// devices.
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <string>
#include <system_error>

#include "app/cli/cli.hpp"
#include "app/cli/exit_codes.hpp"
#include "app/machine/state_table.hpp"
#include "app/shell/replay.hpp"
#include "app/wiring/run_check.hpp"
#include "app/wiring/run_job.hpp"
#include "hal/sim/cell_file.hpp"
#include "hal/sim/faults.hpp"
#include "hal/sim/ur_controller/tcp_service.hpp"
#include "hal/ur/control_script.hpp"
#include "platform/linux/files.hpp"
#include "platform/linux/process.hpp"

namespace firstlook {
namespace {

/// The faults are the simulated cell's: what it would refuse in every cell is refused once, before the first.
int run_campaign_of(const CampaignCommandOptions& options) {
  if (const auto faults = sim::parse_faults(options.faults); !faults) return fail(faults.error());
  return run_campaign_command(options);
}

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

int run_ur_sim(const UrSimCommand& command) {
  sim::ur::SimulatedUrOptions options;
  std::string model = command.model;
  if (!command.cell.empty()) {
    const auto scene = sim::load_cell(command.cell, command.seed);
    if (!scene) return fail(scene.error());
    model = scene->arm.name.view();
    options.start_rad = scene->start_rad;
  }
  const auto identity = sim::ur::identify_controller(model, command.seed, command.serial);
  if (!identity) return fail(identity.error());
  options.running = command.running || command.play_after_s >= 0;
  for (const std::string& path : command.programs) {
    const Result<std::string> script = read_text_file(path, sim::ur::kScriptBytesMax);
    if (!script) return fail(script.error());
    options.programs.push_back({std::filesystem::path(path).stem().string() + ".urp", *script, {}});
  }
  std::string asked = command.external_control;
  if (asked.empty() && command.play_after_s >= 0) asked = "127.0.0.1";
  if (!asked.empty()) {
    const auto external = external_control_of(asked);
    if (!external) return fail(external.error());
    options.programs.push_back({"external_control.urp", "", *external});
  }
  sim::ur::SimulatedUr robot(*identity, options);
  catch_stop_signals();
  const Status served =
      sim::ur::serve_on_tcp(robot, {command.host, command.port_offset, !command.cell.empty(), command.play_after_s});
  if (served) return kExitDone;
  std::fprintf(
      stderr,
      "firstlook: E%d %s\n      Give --host an address of this computer; a port that is taken: end the program "
      "that has it, or choose another --port-offset. Ports below 1024 need root.\n",
      static_cast<int>(served.error().fault), std::string(served.error().detail()).c_str());
  return exit_code_of(served.error());
}

int run_ur_script(const UrScriptCommand& command) {
  // It becomes part of a program: nothing that ends a string of URScript.
  const bool address = !command.host.empty() && std::ranges::all_of(command.host, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_' || c == ':';
  });
  if (!address) {
    return fail(
        failure(Fault::kUsage, "--host '{}' is neither a name nor an address of a computer", command.host).error());
  }
  const std::string script = ur::control_script(command.host, static_cast<std::uint16_t>(command.port));
  if (command.out == "-") {
    std::fputs(script.c_str(), stdout);
  } else if (const Status written = write_file_atomically(command.out, script); !written) {
    return fail(written.error());
  }
  return kExitDone;
}

/// Data that nobody received must not look like success: a full disk shows itself only here.
bool flush_stdout() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return true;
  std::fprintf(stderr, "firstlook: E%d cannot write to stdout: %s\n", static_cast<int>(Fault::kDiskWrite),
               std::strerror(errno));
  return false;
}

struct Dispatch {
  int operator()(const RunCommand& c) const { return run_job(c); }
  int operator()(const CalibrateCommandOptions& c) const { return run_calibrate_command(c); }
  int operator()(const MapCommandOptions& c) const { return run_map_command(c); }
  int operator()(const ExportCommandOptions& c) const { return run_export_command(c); }
  int operator()(const BoardCommandOptions& c) const { return run_board_command(c); }
  int operator()(const CampaignCommandOptions& c) const { return run_campaign_of(c); }
  int operator()(const UrSimCommand& c) const { return run_ur_sim(c); }
  int operator()(const UrScriptCommand& c) const { return run_ur_script(c); }
  int operator()(const CheckCommand& c) const { return run_check(c); }
  int operator()(const BundleCommandOptions& c) const { return run_bundle_command(c); }
  int operator()(const ReplayCommand& c) const { return run_replay_command(c.journal); }
  int operator()(const StatesCommand&) const {
    std::fputs(state_diagram().c_str(), stdout);
    return kExitDone;
  }
  int operator()(const ExplainCommand& c) const { return run_explain_command(c.code); }
  int operator()(const ConfigCommandOptions& c) const { return run_config_command(c); }
};

/// Runs a command. Exceptions end here, with the exit code of what they mean: fmt throws std::system_error when stdout
/// takes nothing more; whatever else comes so far is a fault of the program.
int run(const Command& command) {
  try {
    const int code = std::visit(Dispatch{}, command);
    return flush_stdout() ? code : kExitData;
  } catch (const std::system_error& refused) {
    std::fprintf(stderr, "firstlook: E%d cannot write: %s\n", static_cast<int>(Fault::kDiskWrite), refused.what());
    return kExitData;
  } catch (const std::exception& unexpected) {
    std::fprintf(stderr, "firstlook: E%d internal fault: %s\n", static_cast<int>(Fault::kInternal), unexpected.what());
    return kExitInternal;
  }
}

}  // namespace
}  // namespace firstlook

int main(int argc, char** argv) {
  const auto parsed = firstlook::parse_command_line(argc, argv);
  if (!parsed.command) return parsed.exit_code;
  return firstlook::run(*parsed.command);
}
