/// `firstlook run`.
#pragma once

#include "app/cli/cli.hpp"

namespace firstlook {

/// Runs the job on the site that the configuration names, and writes its folder. @return the exit code
int run_job(const RunCommand& command);

}  // namespace firstlook
