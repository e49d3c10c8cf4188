/// Sensors on USB while the program runs: which are there, which came and went; how those of a kind are reset.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "hal/api/device_report.hpp"
#include "hal/usb/advice.hpp"

namespace firstlook::usb {

/// Looks at the bus when something changed, and every ten seconds. Allocates: for `firstlook check`, not for the loop.
class UsbWatch final : public hal::ReportingDevice {
 public:
  /// The bus must outlive the watch.
  explicit UsbWatch(UsbBus& bus) : bus_(bus) {}
  void poll(Instant now);
  [[nodiscard]] Instant next_due() const { return due_; }
  [[nodiscard]] hal::DeviceReport report(Instant now) const override;
  /// Of the last look.
  [[nodiscard]] const std::vector<UsbDevice>& devices() const { return devices_; }
  /// "depth sensor 1d27:0601 at 1-2", for sensors that were there and are not any more.
  [[nodiscard]] const std::vector<std::string>& unplugged() const { return unplugged_; }

 private:
  void look();

  UsbBus& bus_;
  std::vector<UsbDevice> devices_;
  std::vector<std::string> unplugged_;
  std::string trouble_;
  bool looked_ = false;
  std::uint64_t changes_ = 0;
  Instant due_{};
  Instant look_again_{};
};

/// Resets every sensor of these parts that hangs on the bus. Returns how many. Errors of single ones are left out: a
/// sensor that is not there cannot be reset.
int reset_sensors(UsbBus& bus, Part part);

}  // namespace firstlook::usb
