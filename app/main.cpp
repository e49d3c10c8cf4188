/// firstlook: from the command line to what each command does. With app/wiring the only place that names concrete
/// devices.
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <system_error>

#include "app/cli/cli.hpp"
#include "app/cli/exit_codes.hpp"
#include "app/machine/state_table.hpp"
#include "app/shell/replay.hpp"
#include "app/wiring/run_check.hpp"
#include "app/wiring/run_job.hpp"
#include "app/wiring/simulated_ur.hpp"
#include "hal/sim/faults.hpp"
#include "hal/ur/control_script.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

/// The faults are the simulated cell's: what it would refuse in every cell is refused once, before the first.
int run_campaign_of(const CampaignCommandOptions& options) {
  if (const auto faults = sim::parse_faults(options.faults); !faults) return fail(faults.error());
  return run_campaign_command(options);
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
