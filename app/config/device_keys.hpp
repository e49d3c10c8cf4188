/// The keys of the cart's devices.
#pragma once

#include <string>
#include <vector>

#include "app/config/config_keys.hpp"

namespace firstlook {

[[nodiscard]] std::vector<ConfigKey> camera_keys(Config::Camera& camera);
[[nodiscard]] std::vector<ConfigKey> panel_keys(Config::Panel& panel);

/// Two buttons or two lamps on one bit, in words; empty when there are none.
[[nodiscard]] std::string broken_panel_rule(const Config::Panel& panel);

}  // namespace firstlook
