/// `firstlook check`.
#pragma once

#include "app/cli/cli.hpp"

namespace firstlook {

/// Asks the devices that the configuration names, and those of the simulated cell in place of the others.
/// @return the exit code
int run_check(const CheckCommand& command);

}  // namespace firstlook
