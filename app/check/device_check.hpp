/// What `firstlook check` asks of each device, whoever made it.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/api/cameras.hpp"
#include "hal/api/device_report.hpp"
#include "hal/api/operator_devices.hpp"
#include "hal/api/robot_arm.hpp"
#include "platform/loop/clock.hpp"

namespace firstlook {

/// A device that is watched for a moment.
class WatchedDevice {
 public:
  virtual ~WatchedDevice() = default;
  virtual void poll(Instant now) = 0;
  [[nodiscard]] virtual Instant next_due() const = 0;
  [[nodiscard]] virtual hal::DeviceReport report(Instant now) const = 0;
};

// Watches a device through its interface of hal/api. A device that can tell of itself (`own`, may be null) is believed
// about its state; what was seen of it is added, and a stream that promised frames and gave none is not ready. Devices
// must outlive the watch.
[[nodiscard]] std::unique_ptr<WatchedDevice> watch_stream(hal::FrameStream& stream, const hal::ReportingDevice* own);
/// The same, and one that sends the same picture again and again is not ready, either.
[[nodiscard]] std::unique_ptr<WatchedDevice> watch_depth(hal::DepthCamera& camera, const hal::ReportingDevice* own);
[[nodiscard]] std::unique_ptr<WatchedDevice> watch_arm(hal::RobotArm& arm, const hal::ReportingDevice* own);
[[nodiscard]] std::unique_ptr<WatchedDevice> watch_pendant(hal::Pendant& pendant, const hal::ReportingDevice* own);
[[nodiscard]] std::unique_ptr<WatchedDevice> watch_panel(hal::Panel& panel, const hal::ReportingDevice* own);
/// A device that could not even be made, with the reason.
[[nodiscard]] std::unique_ptr<WatchedDevice> absent_device(std::string_view device, const Error& error);

struct DeviceCheck {
  std::string role;        ///< "colour camera"
  bool simulated = false;  ///< part of the simulated cell
  std::unique_ptr<WatchedDevice> device;
};

struct CheckedDevice {
  std::string role;
  bool simulated = false;
  hal::DeviceReport report;
};

struct CheckResult {
  std::vector<CheckedDevice> devices;
  std::vector<std::string> warnings;
  [[nodiscard]] bool all_ready() const;
};

/// Polls all of them at their pace until each is ready and was watched for a second, or for six seconds at most: what
/// is missing may still be starting.
[[nodiscard]] std::vector<CheckedDevice> watch_devices(std::span<const DeviceCheck> checks, Clock& clock);

}  // namespace firstlook
