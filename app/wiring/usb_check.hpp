/// The sensors on USB, for `firstlook check`; and what resets a silent one.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/check/device_check.hpp"
#include "hal/usb/usb_watch.hpp"

namespace firstlook {

inline constexpr std::string_view kUsbRole = "usb";

/// A bus and the watch on it. Where USB cannot be looked at there is no check, and a warning that says so.
class UsbCheck {
 public:
  UsbCheck();
  /// Adds the check of the sensors.
  void add_to(std::vector<DeviceCheck>& checks) const;
  /// What is wrong with where they are plugged in, as of the last look.
  [[nodiscard]] std::vector<std::string> warnings() const;

 private:
  std::shared_ptr<usb::UsbBus> bus_;
  std::shared_ptr<usb::UsbWatch> watch_;
  std::string trouble_;
};

/// Resets the sensors of a kind on this computer's bus; for the last resort of a driver.
[[nodiscard]] std::function<void()> usb_reset_of(usb::Part part);

}  // namespace firstlook
