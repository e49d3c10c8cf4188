/// Which USB devices are sensors, and what is wrong with where they are plugged in. Pure.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/usb/usb_bus.hpp"

namespace firstlook::usb {

enum class Part : std::uint8_t {
  kNone,          ///< no sensor of firstlook
  kDepthSensor,   ///< PrimeSense, Xtion
  kKinectCamera,  ///< of a Kinect v1, which is a hub with three devices
  kKinectMotor,
  kKinectAudio,
  kColorCamera,  ///< any camera of the class video
};

[[nodiscard]] Part part_of(const UsbDevice& device);
[[nodiscard]] std::string_view name_of(Part part);
/// Whether it streams pictures: a sensor whose place matters.
[[nodiscard]] bool streams(Part part);

/// "Kinect camera at 1-2.1 (480 Mbit/s)", one after the other; "no sensor" when there is none.
[[nodiscard]] std::string sensors_text(std::span<const UsbDevice> devices);

/// In plain words what will not work as the sensors are plugged in, and what to do about it; empty when all is well.
/// Looks for: a Kinect without its supply; sensors on a cable or hub that is too slow; isochronous sensors that want
/// more of one USB 2 bus than it grants; devices that draw more than a hub without a supply may give.
[[nodiscard]] std::vector<std::string> advise(std::span<const UsbDevice> devices);

}  // namespace firstlook::usb
