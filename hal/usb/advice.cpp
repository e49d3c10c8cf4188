#include "hal/usb/advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace firstlook::usb {
namespace {

struct KnownDevice {
  std::uint16_t vendor, product;
  Part part;
};
// The same as in toolchain/packaging/60-firstlook.rules.
constexpr KnownDevice kKnown[] = {
    {0x1d27, 0x0500, Part::kDepthSensor}, {0x1d27, 0x0600, Part::kDepthSensor},  {0x1d27, 0x0601, Part::kDepthSensor},
    {0x1d27, 0x0609, Part::kDepthSensor}, {0x1d27, 0x1250, Part::kDepthSensor},  {0x1d27, 0x1260, Part::kDepthSensor},
    {0x1d27, 0x1270, Part::kDepthSensor}, {0x1d27, 0x1280, Part::kDepthSensor},  {0x1d27, 0x1290, Part::kDepthSensor},
    {0x1d27, 0xf9db, Part::kDepthSensor}, {0x045e, 0x02ae, Part::kKinectCamera}, {0x045e, 0x02bf, Part::kKinectCamera},
    {0x045e, 0x02b0, Part::kKinectMotor}, {0x045e, 0x02c2, Part::kKinectMotor},  {0x045e, 0x02ad, Part::kKinectAudio},
    {0x045e, 0x02be, Part::kKinectAudio},
};

// A microframe of 125 us at 480 Mbit/s is 7500 bytes; at most 80 % of them are periodic (USB 2.0, 5.6.4).
constexpr int kPeriodicBytes = 6000;
constexpr int kPortCurrent_ma = 100;  // of a hub without a supply of its own (USB 2.0, 7.2.1.1)

std::string label(const UsbDevice& device) {
  return fmt::format("{} at USB {}", name_of(part_of(device)), device.path.view());
}

const UsbDevice* find(std::span<const UsbDevice> devices, std::string_view path) {
  const auto found = std::ranges::find_if(devices, [&](const UsbDevice& d) { return d.at(path); });
  return found == devices.end() ? nullptr : &*found;
}

void look_for_supply(std::span<const UsbDevice> devices, std::vector<std::string>& advice) {
  for (const UsbDevice& motor : devices) {
    if (part_of(motor) != Part::kKinectMotor) continue;
    const FixedText<32> hub = hub_of(motor.path.view());
    const bool camera = std::ranges::any_of(devices, [&](const UsbDevice& d) {
      return part_of(d) == Part::kKinectCamera && hub_of(d.path.view()).view() == hub.view();
    });
    if (!camera) {
      advice.push_back(fmt::format(
          "{} answers, its camera does not: the Kinect lacks its 12 V. Plug in its power supply", label(motor)));
    }
  }
}

void look_at_speed(std::span<const UsbDevice> devices, std::vector<std::string>& advice) {
  for (const UsbDevice& device : devices) {
    if (!streams(part_of(device)) || device.speed == Speed::kUnknown || device.speed >= Speed::kHigh) continue;
    const FixedText<32> place = hub_of(device.path.view());
    const UsbDevice* const hub = find(devices, place.view());
    const bool slow_hub = hub != nullptr && hub->speed != Speed::kUnknown && hub->speed < Speed::kHigh;
    advice.push_back(fmt::format(
        "{} runs at {} Mbit/s and needs 480: {}", label(device), megabits(device.speed),
        slow_hub ? fmt::format("the hub at {} is too slow. Plug the sensor into the computer itself", place.view())
                 : "try another cable, without an extension, and another socket"));
  }
}

void look_at_bandwidth(std::span<const UsbDevice> devices, std::vector<std::string>& advice) {
  std::map<int, std::vector<const UsbDevice*>> sharing;
  for (const UsbDevice& device : devices) {
    if (streams(part_of(device)) && device.speed == Speed::kHigh && device.isochronous_bytes > 0)
      sharing[device.bus].push_back(&device);
  }
  for (const auto& [bus, sensors] : sharing) {
    int bytes = 0;
    std::string names;
    for (const UsbDevice* sensor : sensors) {
      bytes += sensor->isochronous_bytes;
      names += fmt::format("{}{}", names.empty() ? "" : ", ", label(*sensor));
    }
    if (sensors.size() < 2 || bytes <= kPeriodicBytes) continue;
    advice.push_back(fmt::format(
        "{} share bus {} and may ask for {} % of what it grants: frames will be lost, or one does not start. "
        "Plug one into a socket of another USB controller, or lower the camera's size or rate",
        names, bus, 100 * bytes / kPeriodicBytes));
  }
}

void look_at_power(std::span<const UsbDevice> devices, std::vector<std::string>& advice) {
  for (const UsbDevice& device : devices) {
    if (device.is_hub || device.current_ma <= kPortCurrent_ma) continue;
    const UsbDevice* const hub = find(devices, hub_of(device.path.view()).view());
    if (hub == nullptr || !hub->is_hub || hub->self_powered || hub->path.view().starts_with("usb")) continue;
    if (part_of(device) == Part::kNone) continue;
    advice.push_back(
        fmt::format("{} draws up to {} mA, the hub at {} has no supply of its own and gives {}: plug the sensor "
                    "into the computer, or use a hub with a power supply",
                    label(device), device.current_ma, hub->path.view(), kPortCurrent_ma));
  }
}

}  // namespace

Part part_of(const UsbDevice& device) {
  for (const KnownDevice& known : kKnown) {
    if (known.vendor == device.vendor && known.product == device.product) return known.part;
  }
  return device.is_video ? Part::kColorCamera : Part::kNone;
}

std::string_view name_of(Part part) {
  switch (part) {
    case Part::kNone:
      return "device";
    case Part::kDepthSensor:
      return "depth sensor";
    case Part::kKinectCamera:
      return "Kinect camera";
    case Part::kKinectMotor:
      return "Kinect motor";
    case Part::kKinectAudio:
      return "Kinect microphones";
    case Part::kColorCamera:
      return "camera";
  }
  return "";
}

bool streams(Part part) {
  return part == Part::kDepthSensor || part == Part::kKinectCamera || part == Part::kColorCamera;
}

std::string sensors_text(std::span<const UsbDevice> devices) {
  std::string text;
  for (const UsbDevice& device : devices) {
    const Part part = part_of(device);
    if (part == Part::kNone) continue;
    text += fmt::format("{}{} {:04x}:{:04x} at {} ({} Mbit/s)", text.empty() ? "" : ", ", name_of(part), device.vendor,
                        device.product, device.path.view(), megabits(device.speed));
  }
  return text.empty() ? "no sensor" : text;
}

std::vector<std::string> advise(std::span<const UsbDevice> devices) {
  std::vector<std::string> advice;
  look_for_supply(devices, advice);
  look_at_speed(devices, advice);
  look_at_bandwidth(devices, advice);
  look_at_power(devices, advice);
  return advice;
}

}  // namespace firstlook::usb
