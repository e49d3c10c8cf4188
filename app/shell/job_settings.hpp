/// What of configuration and command line decides how a job runs; goes into the journal's header so that a replay makes
/// the same machine.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/config/config.hpp"
#include "app/machine/machine.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// "everything", "calibrate", "map" or "verify".
[[nodiscard]] std::string_view name_of(RunScope scope);
[[nodiscard]] std::optional<RunScope> find_scope(std::string_view name);

/// The machine's part of the configuration; `parking_rad` of the configuration must be set.
[[nodiscard]] MachineSettings machine_settings(const Config& config, RunScope scope);

/// The configuration as YAML behind a first line that names the scope.
[[nodiscard]] std::string journal_config(const Config& config, RunScope scope);
/// Errors: kJournalBroken when the text is not of journal_config.
[[nodiscard]] Result<MachineSettings> settings_from_journal(const std::string& text);

}  // namespace firstlook
