/// From files, environment and flags to a Config; and back to a commented file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/config/config.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// A key given outside a file: `path` with dots ("arm.speed_max_m_s"), `value` as YAML would have it.
struct ConfigOverride {
  std::string path;
  std::string value;
  std::string origin;  ///< for errors: "--seed", "FIRSTLOOK_SEED"
};

/// Where values come from, weakest first: defaults, file, environment, flags.
struct ConfigSources {
  std::optional<std::filesystem::path> file;                            ///< of --config; must exist when given
  std::filesystem::path system_file = "/etc/firstlook/firstlook.yaml";  ///< read when there and no `file` is given
  std::vector<std::string> environment;  ///< "NAME=value"; only names that begin with FIRSTLOOK_ count
  std::vector<ConfigOverride> flags;
};

/// What was loaded, and whether anything besides the defaults and the flags took part.
struct LoadedConfig {
  Config config;
  std::string file;  ///< the file that was read; empty without one
};

/// The process's environment as ConfigSources takes it.
[[nodiscard]] std::vector<std::string> process_environment();

/// Applies all sources and checks the whole.
/// @return kConfigUnreadable, kConfigUnknownKey (with the nearest known key) or kConfigBadValue (with the range), each
///         with file:line:column or the name of the variable; kUsage with the name of the flag for what a flag says
[[nodiscard]] Result<LoadedConfig> load_config(const ConfigSources& sources);

/// Parses YAML text over the defaults; `name` stands for the file in errors. Errors as load_config.
[[nodiscard]] Result<Config> parse_config(std::string_view yaml, std::string_view name);

/// Every key with its value, its meaning and its limits, as YAML that parse_config reads back to the same Config.
[[nodiscard]] std::string print_config(const Config& config);

}  // namespace firstlook
