/// The command line: what was asked for, as values. Running it is main's business.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "app/cli/board_command.hpp"
#include "app/cli/bundle_command.hpp"
#include "app/cli/calibrate_command.hpp"
#include "app/cli/campaign_command.hpp"
#include "app/cli/export_command.hpp"
#include "app/cli/map_command.hpp"
#include "app/cli/small_commands.hpp"
#include "app/config/load_config.hpp"
#include "app/machine/machine.hpp"

namespace firstlook {

struct RunCommand {
  ConfigSources sources;  ///< cell, seed and workers come as flags among them
  bool cell_given = false;
  RunScope scope = RunScope::kEverything;
  bool fast_sensor = false;
  bool real_time = false;
  bool json = false;
  bool record = false;
  bool resume = false;
  std::string out;  ///< empty: runs/<date>-<seed>
  std::string faults;
  std::vector<std::string> robot_happens;  ///< "SECONDS=WHAT" of a controller in this process, as UrSimCommand's
};
struct UrScriptCommand {
  std::string host;  ///< of this computer, as the controller sees it
  int port = 50001;
  std::string out = "firstlook.script";  ///< "-": stdout
};
struct CheckCommand {
  ConfigSources sources;
  bool json = false;
};
struct ReplayCommand {
  std::string journal;
};
struct StatesCommand {};
struct ExplainCommand {
  std::string code;
};
struct UrSimCommand {
  std::string model = "ur5";
  std::string host = "127.0.0.1";
  int port_offset = 0;
  std::uint64_t seed = 0;
  std::string serial;                 ///< empty: made up from the seed
  bool running = false;               ///< starts with the brakes released
  std::vector<std::string> programs;  ///< URScript files that `load` finds
  std::string external_control;       ///< HOST or HOST:PORT; empty: no such program
  std::string cell;                   ///< where the arm stands; its true joints are told to the cell's cameras
  double play_after_s = -1;           ///< somebody presses Play; below 0: nobody
  bool lockstep = false;              ///< its time is that of `firstlook run --robot`
  std::vector<std::string> happens;   ///< "SECONDS=WHAT", as read_timed_happening reads them
  bool console = false;
};

using Command = std::variant<RunCommand, CalibrateCommandOptions, MapCommandOptions, ExportCommandOptions,
                             BoardCommandOptions, CampaignCommandOptions, ReplayCommand, StatesCommand, ExplainCommand,
                             ConfigCommandOptions, UrSimCommand, UrScriptCommand, CheckCommand, BundleCommandOptions>;

/// Either a command, or the exit code after help, version or an error of usage were printed.
struct ParsedCommandLine {
  std::optional<Command> command;
  int exit_code = 0;
};
[[nodiscard]] ParsedCommandLine parse_command_line(int argc, const char* const* argv);

}  // namespace firstlook
