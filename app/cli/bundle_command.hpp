/// `firstlook bundle DIR`: a run for support.
#pragma once

#include <string>

#include "app/config/load_config.hpp"

namespace firstlook {

struct BundleCommandOptions {
  std::string folder;
  std::string out;  ///< empty: the folder's name with .tar.gz, in the working directory
  ConfigSources sources;
};

/// Prints the archive's path on stdout; what it holds, lacks and shows on stderr.
/// @return 0, or 3 when there is no run, the configuration cannot be read, or the archive cannot be written
int run_bundle_command(const BundleCommandOptions& options);

}  // namespace firstlook
