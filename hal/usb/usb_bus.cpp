#include "hal/usb/usb_bus.hpp"

namespace firstlook::usb {

double megabits(Speed speed) {
  switch (speed) {
    case Speed::kUnknown:
      return 0;
    case Speed::kLow:
      return 1.5;
    case Speed::kFull:
      return 12;
    case Speed::kHigh:
      return 480;
    case Speed::kSuper:
      return 5000;
  }
  return 0;
}

FixedText<32> hub_of(std::string_view path) {
  FixedText<32> hub;
  if (const auto dot = path.rfind('.'); dot != std::string_view::npos) {
    hub.set("{}", path.substr(0, dot));
  } else if (const auto dash = path.find('-'); dash != std::string_view::npos) {
    hub.set("usb{}", path.substr(0, dash));
  }
  return hub;
}

}  // namespace firstlook::usb
