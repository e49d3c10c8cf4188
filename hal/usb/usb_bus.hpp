/// USB as this computer sees it: what hangs where. The adapter to libusb is libusb_bus; tests have a bus of their own.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "platform/core/fixed_text.hpp"
#include "platform/core/result.hpp"

namespace firstlook::usb {

enum class Speed : std::uint8_t { kUnknown, kLow, kFull, kHigh, kSuper };

/// 1.5, 12, 480, 5000 Mbit/s (USB 2.0, 4.2.1; USB 3.2, 3.1); 0: not known.
[[nodiscard]] double megabits(Speed speed);

struct UsbDevice {
  int bus = 0;
  FixedText<32> path;  ///< as the kernel names it: "2-1.4" is on bus 2, port 1, there on port 4 of a hub; "usb2": bus 2
  std::uint16_t vendor = 0, product = 0;
  Speed speed = Speed::kUnknown;
  bool is_hub = false;
  bool is_video = false;      ///< has an interface of the class video
  bool self_powered = false;  ///< a hub with its own supply
  int current_ma = 0;         ///< that it may draw from its port
  int isochronous_bytes = 0;  ///< that it may reserve in each microframe of 125 us; 0: nothing
  FixedText<64> name;         ///< what it calls itself; empty when it may not be asked
  [[nodiscard]] bool at(std::string_view place) const { return path.view() == place; }
};

/// The path of the hub that a device of this path is plugged into: "2-1" for "2-1.4", "usb2" for "2-1".
[[nodiscard]] FixedText<32> hub_of(std::string_view path);

/// One thread at a time.
class UsbBus {
 public:
  virtual ~UsbBus() = default;
  /// All devices, hubs among them, ordered by path. Takes some milliseconds. Error: kDeviceMissing.
  [[nodiscard]] virtual Result<std::vector<UsbDevice>> devices() = 0;
  /// How often a device came or went since this was made. Never blocks.
  [[nodiscard]] virtual std::uint64_t changes() = 0;
  /// As if it were unplugged and plugged in again; whoever has it open loses it. Error: kDeviceMissing, with the
  /// reason.
  [[nodiscard]] virtual Status reset(std::string_view path) = 0;
};

/// This computer's. Error: kDeviceMissing when libusb does not start; a computer without USB has no devices.
[[nodiscard]] Result<std::unique_ptr<UsbBus>> make_libusb_bus();

}  // namespace firstlook::usb
