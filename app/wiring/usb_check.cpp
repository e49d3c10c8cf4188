#include "app/wiring/usb_check.hpp"

namespace firstlook {
namespace {

class WatchedUsb final : public WatchedDevice {
 public:
  WatchedUsb(std::shared_ptr<usb::UsbBus> bus, std::shared_ptr<usb::UsbWatch> watch)
      : bus_(std::move(bus)), watch_(std::move(watch)) {}
  void poll(Instant now) override { watch_->poll(now); }
  [[nodiscard]] Instant next_due() const override { return watch_->next_due(); }
  [[nodiscard]] hal::DeviceReport report(Instant now) const override { return watch_->report(now); }

 private:
  std::shared_ptr<usb::UsbBus> bus_;  ///< behind the watch
  std::shared_ptr<usb::UsbWatch> watch_;
};

}  // namespace

UsbCheck::UsbCheck() {
  auto made = usb::make_libusb_bus();
  if (!made) {
    trouble_ = fmt::format("USB cannot be looked at: {}", made.error().detail());
    return;
  }
  bus_ = std::move(*made);
  watch_ = std::make_shared<usb::UsbWatch>(*bus_);
}

void UsbCheck::add_to(std::vector<DeviceCheck>& checks) const {
  if (watch_) checks.push_back({std::string(kUsbRole), false, std::make_unique<WatchedUsb>(bus_, watch_)});
}

std::vector<std::string> UsbCheck::warnings() const {
  if (!watch_) return {trouble_};
  return usb::advise(watch_->devices());
}

std::function<void()> usb_reset_of(usb::Part part) {
  return [part] {
    const auto bus = usb::make_libusb_bus();
    if (bus) (void)usb::reset_sensors(**bus, part);
  };
}

}  // namespace firstlook
