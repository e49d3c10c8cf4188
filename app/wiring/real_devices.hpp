/// The devices of a real cart by their drivers, as the configuration names them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/check/device_check.hpp"
#include "app/config/config.hpp"
#include "app/shell/device_source.hpp"

namespace firstlook {

/// Roles of devices in words, as `firstlook check` lists them.
inline constexpr std::string_view kArmRole = name_of(CartDevice::kArm);
inline constexpr std::string_view kColorRole = name_of(CartDevice::kColorCamera);
inline constexpr std::string_view kDepthRole = name_of(CartDevice::kDepthCamera);
inline constexpr std::string_view kPendantRole = "pendant";
inline constexpr std::string_view kPanelRole = name_of(CartDevice::kPanel);

/// Whether the configuration names any.
[[nodiscard]] bool names_real_devices(const Config& config);

/// The cameras and the panel of a job; they live as long as this. Where the configuration names no panel it is one
/// without buttons and lights.
struct RealDevices {
  hal::ColorCamera* color = nullptr;
  hal::DepthCamera* depth = nullptr;
  hal::Panel* panel = nullptr;
  TellingDevices telling;
  std::vector<std::shared_ptr<void>> owned;
};

/// Opens what the configuration names; it must name both cameras. Errors: those of the drivers and of a
/// camera_info.yaml that is named, as real_device_checks.
/// @param asked  as open_panel
[[nodiscard]] Result<RealDevices> open_real_devices(const Config& config, std::vector<CheckedDevice>& asked);

/// The panel alone; null where the configuration names none. Asks it first, which takes a second: its Stop must work
/// before anything moves. Error: kDeviceMissing when it does not answer, or not as the configuration says.
/// @param asked  takes what such a panel said: nobody need ask it again
struct OpenedPanel {
  std::shared_ptr<hal::Panel> panel;
  TellingDevices telling;
};
[[nodiscard]] Result<OpenedPanel> open_panel(const Config& config, std::vector<CheckedDevice>& asked);

/// A check of each device that the configuration names; one that cannot even be made says why. Errors: those of a
/// camera_info.yaml that is named: kDataMissing, kDataMalformed, kConfigBadValue for one of another size.
[[nodiscard]] Result<std::vector<DeviceCheck>> real_device_checks(const Config& config);

}  // namespace firstlook
