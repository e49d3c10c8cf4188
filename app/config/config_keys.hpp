/// The table of configuration keys: parsing, printing, ranges and documentation all read it.
#pragma once

#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "algorithms/mapping/sensor_presets.hpp"
#include "app/config/config.hpp"

namespace firstlook {

/// The field of one Config that a key stands for.
using ConfigField = std::variant<double*, int*, std::int64_t*, std::string*, std::array<double, 3>*,
                                 std::optional<JointVector>*, std::vector<Config::KeepOut>*>;

struct ConfigKey {
  std::string_view path;  ///< with dots: "arm.speed_max_m_s"
  ConfigField field;
  double low = 0, high = 0;                   ///< of each number, both included; not used for text
  std::span<const std::string_view> choices;  ///< of text; empty: any
  std::string_view meaning;
};

/// Every key, in the order in which they are printed; keys of one section stand together. The fields point into
/// `config`.
[[nodiscard]] std::vector<ConfigKey> config_keys(Config& config);

/// The figures of a sensor, in place of all that `depth` holds.
void set_sensor(const SensorPreset& preset, Config::Depth& depth);

/// What single ranges cannot say: the first rule between keys that `config` breaks, in words; empty when all hold.
[[nodiscard]] std::string broken_rule(const Config& config);

}  // namespace firstlook
