/// The command line: what was asked for, as values. Running it is main's business.
#pragma once

#include <optional>
#include <string>
#include <variant>

#include "app/cli/board_command.hpp"
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
  std::string out;  ///< empty: runs/<date>-<seed>
  std::string faults;
};
struct ReplayCommand {
  std::string journal;
};
struct StatesCommand {};
struct ExplainCommand {
  std::string code;
};

using Command =
    std::variant<RunCommand, CalibrateCommandOptions, MapCommandOptions, ExportCommandOptions, BoardCommandOptions,
                 CampaignCommandOptions, ReplayCommand, StatesCommand, ExplainCommand, ConfigCommandOptions>;

/// Either a command, or the exit code after help, version or an error of usage were printed.
struct ParsedCommandLine {
  std::optional<Command> command;
  int exit_code = 0;
};
[[nodiscard]] ParsedCommandLine parse_command_line(int argc, const char* const* argv);

}  // namespace firstlook
