/// The adapter to libusb-1.0: its types end here.
#include <libusb.h>

#include <algorithm>
#include <array>

#include "hal/usb/usb_bus.hpp"

namespace firstlook::usb {
namespace {

constexpr int kPortsMax = 7;              // USB 3.2, 10.16.2.10: hubs five deep and the device's own
constexpr unsigned kCurrentStep_ma = 2;   // of bMaxPower at high speed and below (USB 2.0, 9.6.3)
constexpr unsigned kSelfPowered = 0x40;   // of bmAttributes
constexpr unsigned kPacketBytes = 0x7FF;  // of wMaxPacketSize; bits 11 and 12: further packets in a microframe

FixedText<32> path_of(libusb_device* device) {
  std::array<std::uint8_t, kPortsMax> ports{};
  const int deep = libusb_get_port_numbers(device, ports.data(), kPortsMax);
  FixedText<32> path;
  const int bus = libusb_get_bus_number(device);
  if (deep <= 0) {
    path.set("usb{}", bus);
    return path;
  }
  path.set("{}-{}", bus, ports[0]);
  for (int i = 1; i < deep; ++i) {
    const FixedText<32> before = path;
    path.set("{}.{}", before.view(), ports[static_cast<std::size_t>(i)]);
  }
  return path;
}

Speed speed_of(libusb_device* device) {
  switch (libusb_get_device_speed(device)) {
    case LIBUSB_SPEED_LOW:
      return Speed::kLow;
    case LIBUSB_SPEED_FULL:
      return Speed::kFull;
    case LIBUSB_SPEED_HIGH:
      return Speed::kHigh;
    case LIBUSB_SPEED_SUPER:
    case LIBUSB_SPEED_SUPER_PLUS:
      return Speed::kSuper;
    default:
      return Speed::kUnknown;
  }
}

/// The most that the isochronous endpoints of one alternate setting reserve, summed over the interfaces.
void read_interfaces(const libusb_config_descriptor& configuration, UsbDevice& device) {
  for (int i = 0; i < configuration.bNumInterfaces; ++i) {
    const libusb_interface& interface = configuration.interface[i];
    int most = 0;
    for (int a = 0; a < interface.num_altsetting; ++a) {
      const libusb_interface_descriptor& setting = interface.altsetting[a];
      device.is_video = device.is_video || setting.bInterfaceClass == LIBUSB_CLASS_VIDEO;
      int bytes = 0;
      for (int e = 0; e < setting.bNumEndpoints; ++e) {
        const libusb_endpoint_descriptor& endpoint = setting.endpoint[e];
        if ((endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_ISOCHRONOUS) continue;
        const unsigned size = endpoint.wMaxPacketSize;
        bytes += static_cast<int>((size & kPacketBytes) * (1 + (size >> 11U & 3U)));
      }
      most = std::max(most, bytes);
    }
    device.isochronous_bytes += most;
  }
}

void read_name(libusb_device* device, std::uint8_t index, UsbDevice& told) {
  libusb_device_handle* handle = nullptr;
  if (index == 0 || libusb_open(device, &handle) != 0) return;
  std::array<unsigned char, 128> text{};
  const int size = libusb_get_string_descriptor_ascii(handle, index, text.data(), static_cast<int>(text.size()));
  if (size > 0)
    told.name.set("{}", std::string_view(reinterpret_cast<const char*>(text.data()), static_cast<std::size_t>(size)));
  libusb_close(handle);
}

UsbDevice describe(libusb_device* device) {
  UsbDevice told;
  told.bus = libusb_get_bus_number(device);
  told.path = path_of(device);
  told.speed = speed_of(device);
  libusb_device_descriptor descriptor{};
  if (libusb_get_device_descriptor(device, &descriptor) != 0) return told;
  told.vendor = descriptor.idVendor;
  told.product = descriptor.idProduct;
  told.is_hub = descriptor.bDeviceClass == LIBUSB_CLASS_HUB;
  libusb_config_descriptor* configuration = nullptr;
  if (libusb_get_active_config_descriptor(device, &configuration) == 0) {
    told.current_ma = static_cast<int>(configuration->MaxPower * kCurrentStep_ma);
    told.self_powered = (configuration->bmAttributes & kSelfPowered) != 0;
    read_interfaces(*configuration, told);
    libusb_free_config_descriptor(configuration);
  }
  if (!told.is_hub) read_name(device, descriptor.iProduct, told);
  return told;
}

class LibusbBus final : public UsbBus {
 public:
  static Result<std::unique_ptr<UsbBus>> make() {
    auto bus = std::unique_ptr<LibusbBus>(new LibusbBus);
    if (const int code = libusb_init(&bus->context_); code != 0) {
      bus->context_ = nullptr;
      return failure(Fault::kDeviceMissing, "libusb does not start: {}",
                     libusb_strerror(static_cast<libusb_error>(code)));
    }
    bus->watch();
    return bus;
  }
  ~LibusbBus() override {
    if (context_ != nullptr) libusb_exit(context_);
  }
  LibusbBus(const LibusbBus&) = delete;
  LibusbBus& operator=(const LibusbBus&) = delete;

  [[nodiscard]] Result<std::vector<UsbDevice>> devices() override {
    std::vector<UsbDevice> found;
    const Status listed = each([&](libusb_device* device) { found.push_back(describe(device)); });
    if (!listed) return std::unexpected(listed.error());
    std::ranges::sort(found, {}, [](const UsbDevice& d) { return d.path.view(); });
    return found;
  }

  [[nodiscard]] std::uint64_t changes() override {
    timeval none{};
    (void)libusb_handle_events_timeout_completed(context_, &none, nullptr);
    return changes_;
  }

  [[nodiscard]] Status reset(std::string_view path) override {
    int code = LIBUSB_ERROR_NO_DEVICE;
    const Status listed = each([&](libusb_device* device) {
      if (path_of(device).view() != path) return;
      libusb_device_handle* handle = nullptr;
      code = libusb_open(device, &handle);
      if (code != 0) return;
      code = libusb_reset_device(handle);
      libusb_close(handle);
      // It came back as another device: that is what a reset of a Kinect does.
      if (code == LIBUSB_ERROR_NOT_FOUND) code = 0;
    });
    if (!listed) return listed;
    if (code == 0) return {};
    return failure(Fault::kDeviceMissing, "USB device {} cannot be reset: {}", path,
                   libusb_strerror(static_cast<libusb_error>(code)));
  }

 private:
  LibusbBus() = default;

  void watch() {
    if (libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) == 0) return;
    const auto note = [](libusb_context*, libusb_device*, libusb_hotplug_event, void* self) {
      ++static_cast<LibusbBus*>(self)->changes_;
      return 0;
    };
    (void)libusb_hotplug_register_callback(
        context_, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT, 0, LIBUSB_HOTPLUG_MATCH_ANY,
        LIBUSB_HOTPLUG_MATCH_ANY, LIBUSB_HOTPLUG_MATCH_ANY, note, this, nullptr);
  }

  template <typename Use>
  Status each(Use use) {
    libusb_device** list = nullptr;
    const auto count = libusb_get_device_list(context_, &list);
    if (count < 0) {
      return failure(Fault::kDeviceMissing, "USB cannot be listed: {}",
                     libusb_strerror(static_cast<libusb_error>(count)));
    }
    for (std::ptrdiff_t i = 0; i < count; ++i) use(list[i]);
    libusb_free_device_list(list, 1);
    return {};
  }

  libusb_context* context_ = nullptr;
  std::uint64_t changes_ = 0;
};

}  // namespace

Result<std::unique_ptr<UsbBus>> make_libusb_bus() { return LibusbBus::make(); }

}  // namespace firstlook::usb
