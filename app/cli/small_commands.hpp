/// The commands that answer a question and do nothing else. All print on stdout and return the process's exit code.
#pragma once

#include <string>

#include "app/config/load_config.hpp"

namespace firstlook {

/// "0.1.0": the version of CMakeLists.txt.
[[nodiscard]] std::string version_text();

/// `firstlook explain CODE`: name, severity, text and remedy of a fault; the code with or without the leading E.
/// @return 0, or 2 for a code that is not in the table
int run_explain_command(const std::string& code);

struct ConfigCommandOptions {
  bool defaults = false;  ///< the defaults alone; else what a run would use now
  ConfigSources sources;
};

/// `firstlook config [--defaults]`: commented YAML that can be read back.
/// @return 0, or 3 when a source is wrong
int run_config_command(const ConfigCommandOptions& options);

}  // namespace firstlook
