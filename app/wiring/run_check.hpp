/// `firstlook check`.
#pragma once

#include <vector>

#include "app/check/device_check.hpp"
#include "app/cli/cli.hpp"
#include "app/config/config.hpp"
#include "platform/linux/terminal.hpp"

namespace firstlook {

/// Asks the devices that the configuration names, and those of the simulated cell in place of the others.
/// @return the exit code
int run_check(const CheckCommand& command);

/// The real devices alone: what each says after some seconds. Errors: those of real_device_checks.
[[nodiscard]] Result<std::vector<CheckedDevice>> ask_real_devices(const Config& config, Narrator& narrator);

}  // namespace firstlook
