/// The devices of a real cart by their drivers, as the configuration names them. A part of main.cpp, which alone
/// includes it: like it, this file names concrete drivers.
#pragma once

#include <string>
#include <vector>

#include "app/check/device_check.hpp"
#include "app/config/config.hpp"

namespace firstlook {

/// Roles of devices in words, as `firstlook check` lists them.
inline constexpr std::string_view kArmRole = "arm";
inline constexpr std::string_view kColorRole = "colour camera";
inline constexpr std::string_view kDepthRole = "depth camera";
inline constexpr std::string_view kPendantRole = "pendant";
inline constexpr std::string_view kPanelRole = "panel";

/// Whether the configuration names any.
[[nodiscard]] bool names_real_devices(const Config& config);

/// A check of each device that the configuration names; one that cannot even be made says why. Errors: those of a
/// camera_info.yaml that is named: kDataMissing, kDataMalformed, kConfigBadValue for one of another size.
[[nodiscard]] Result<std::vector<DeviceCheck>> real_device_checks(const Config& config);

}  // namespace firstlook
