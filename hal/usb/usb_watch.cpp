#include "hal/usb/usb_watch.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace firstlook::usb {
namespace {

constexpr Duration kStep = milliseconds(200);
constexpr Duration kLookAgain = milliseconds(10000);  // where the system tells of no changes

bool same(const UsbDevice& a, const UsbDevice& b) {
  return a.path.view() == b.path.view() && a.vendor == b.vendor && a.product == b.product;
}

}  // namespace

void UsbWatch::look() {
  auto found = bus_.devices();
  if (!found) {
    trouble_ = std::string(found.error().detail());
    return;
  }
  trouble_.clear();
  for (const UsbDevice& was : devices_) {
    if (part_of(was) == Part::kNone) continue;
    if (std::ranges::any_of(*found, [&](const UsbDevice& d) { return same(d, was); })) continue;
    unplugged_.push_back(
        fmt::format("{} {:04x}:{:04x} at {}", name_of(part_of(was)), was.vendor, was.product, was.path.view()));
  }
  std::erase_if(unplugged_, [&](const std::string& gone) {
    return std::ranges::any_of(*found, [&](const UsbDevice& d) {
      return gone == fmt::format("{} {:04x}:{:04x} at {}", name_of(part_of(d)), d.vendor, d.product, d.path.view());
    });
  });
  devices_ = std::move(*found);
}

void UsbWatch::poll(Instant now) {
  due_ = now + kStep;
  const std::uint64_t changes = bus_.changes();
  if (looked_ && changes == changes_ && now < look_again_) return;
  changes_ = changes;
  looked_ = true;
  look_again_ = now + kLookAgain;
  look();
}

hal::DeviceReport UsbWatch::report(Instant) const {
  hal::DeviceReport report;
  report.device.set("libusb");
  report.add("sensors", static_cast<double>(
                            std::ranges::count_if(devices_, [](const UsbDevice& d) { return streams(part_of(d)); })));
  report.add("devices",
             static_cast<double>(std::ranges::count_if(devices_, [](const UsbDevice& d) { return !d.is_hub; })));
  report.add("changes", static_cast<double>(changes_));
  if (!trouble_.empty()) {
    report.state = hal::DeviceState::kMissing;
    report.detail.set("{}", trouble_);
    report.remedy.set("Check that the program may read /dev/bus/usb (group plugdev).");
  } else if (!unplugged_.empty()) {
    report.state = hal::DeviceState::kLost;
    report.detail.set("{} went away; there is {}", unplugged_.back(), sensors_text(devices_));
    report.remedy.set(
        "Check its plug and its power; a sensor that comes and goes has a bad cable or too little current.");
  } else if (looked_) {
    report.state = hal::DeviceState::kReady;
    report.detail.set("{}", sensors_text(devices_));
  }
  return report;
}

int reset_sensors(UsbBus& bus, Part part) {
  const auto devices = bus.devices();
  if (!devices) return 0;
  return static_cast<int>(std::ranges::count_if(*devices, [&](const UsbDevice& device) {
    return part_of(device) == part && bus.reset(device.path.view()).has_value();
  }));
}

}  // namespace firstlook::usb
