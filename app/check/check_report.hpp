/// What `firstlook check` says: lines for people, JSON for programs.
#pragma once

#include <string>
#include <vector>

#include "app/check/device_check.hpp"
#include "app/config/config.hpp"

namespace firstlook {

/// What a person has to think of before the first job, which no device can tell: what cameras do not see, and buttons
/// that are asked for and not there.
[[nodiscard]] std::vector<std::string> check_warnings(const Config& config, bool simulated);

/// A line for each device, with what to do below it where something is; then the warnings.
[[nodiscard]] std::string check_text(const CheckResult& result);
/// `{ok, devices[] {role, simulated, device, state, detail, remedy, numbers{}}, warnings[]}`
[[nodiscard]] std::string check_json(const CheckResult& result);

}  // namespace firstlook
