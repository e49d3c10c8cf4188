/// What is said of sensors on USB, against a bus of our own.
#include <catch2/catch.hpp>

#include "hal/api/last_resort.hpp"
#include "hal/usb/usb_watch.hpp"

using namespace firstlook;
using namespace firstlook::usb;
using Catch::Matchers::Contains;

namespace {

UsbDevice device(std::string_view path, std::uint16_t vendor, std::uint16_t product, Speed speed = Speed::kHigh) {
  UsbDevice d;
  d.path.set("{}", path);
  d.bus = path.starts_with("usb") ? path[3] - '0' : path[0] - '0';
  d.vendor = vendor;
  d.product = product;
  d.speed = speed;
  return d;
}

UsbDevice hub(std::string_view path, Speed speed = Speed::kHigh, bool self_powered = true) {
  UsbDevice d = device(path, 0x1d6b, 2, speed);
  d.is_hub = true;
  d.self_powered = self_powered;
  return d;
}

UsbDevice kinect(std::string_view path) {
  UsbDevice d = device(path, 0x045e, 0x02ae);
  d.isochronous_bytes = 1920 + 1760;
  return d;
}

UsbDevice webcam(std::string_view path, int isochronous_bytes, Speed speed = Speed::kHigh) {
  UsbDevice d = device(path, 0x046d, 0x0825, speed);
  d.is_video = true;
  d.isochronous_bytes = isochronous_bytes;
  d.current_ma = 500;
  return d;
}

struct FakeBus final : UsbBus {
  std::vector<UsbDevice> plugged;
  std::uint64_t changed = 0;
  bool broken = false;
  int lists = 0;
  std::vector<std::string> resets;
  Result<std::vector<UsbDevice>> devices() override {
    ++lists;
    if (broken) return failure(Fault::kDeviceMissing, "USB cannot be listed: Access denied");
    return plugged;
  }
  std::uint64_t changes() override { return changed; }
  Status reset(std::string_view path) override {
    for (const UsbDevice& d : plugged) {
      if (!d.at(path)) continue;
      resets.emplace_back(path);
      return {};
    }
    return failure(Fault::kDeviceMissing, "USB device {}", path);
  }
};

}  // namespace

TEST_CASE("a path tells the hub that a device is plugged into") {
  CHECK(hub_of("2-1.4").view() == "2-1");
  CHECK(hub_of("2-1.4.10").view() == "2-1.4");
  CHECK(hub_of("12-3").view() == "usb12");
  CHECK(hub_of("usb2").empty());
}

TEST_CASE("sensors are told by their numbers, cameras by their class, the rest is no sensor") {
  CHECK(part_of(device("1-1", 0x1d27, 0x0601)) == Part::kDepthSensor);
  CHECK(part_of(device("1-1", 0x045e, 0x02ae)) == Part::kKinectCamera);
  CHECK(part_of(device("1-1", 0x045e, 0x02b0)) == Part::kKinectMotor);
  CHECK(part_of(webcam("1-1", 0)) == Part::kColorCamera);
  CHECK(part_of(device("1-1", 0x045e, 0x0040)) == Part::kNone);
  const std::vector<UsbDevice> devices{hub("usb1"), device("1-2", 0x1d27, 0x0601), webcam("1-4", 0, Speed::kFull)};
  CHECK(sensors_text(devices) == "depth sensor 1d27:0601 at 1-2 (480 Mbit/s), camera 046d:0825 at 1-4 (12 Mbit/s)");
  CHECK(sensors_text({}) == "no sensor");
}

TEST_CASE("what is plugged in well gets no advice") {
  CHECK(advise({}).empty());
  const std::vector<UsbDevice> devices{hub("usb1"),
                                       hub("1-1"),
                                       kinect("1-1.1"),
                                       device("1-1.2", 0x045e, 0x02b0),
                                       hub("usb2"),
                                       webcam("2-1", 3072),
                                       device("1-3", 1, 1, Speed::kLow)};
  CHECK(advise(devices).empty());
}

TEST_CASE("a Kinect that lacks its supply shows its motor alone") {
  const std::vector<UsbDevice> devices{hub("usb1"), hub("1-1"), device("1-1.2", 0x045e, 0x02b0), kinect("1-2.1")};
  const auto advice = advise(devices);
  REQUIRE(advice.size() == 1);
  CHECK_THAT(advice[0], Contains("Kinect motor at USB 1-1.2") && Contains("12 V"));
}

TEST_CASE("a sensor at full speed is told whether the hub or the cable is to blame") {
  std::vector<UsbDevice> devices{hub("usb1"), hub("1-1", Speed::kFull), webcam("1-1.3", 1023, Speed::kFull)};
  auto advice = advise(devices);
  REQUIRE(advice.size() == 1);
  CHECK_THAT(advice[0], Contains("camera at USB 1-1.3 runs at 12 Mbit/s and needs 480") && Contains("hub at 1-1"));
  devices[1].speed = Speed::kHigh;
  advice = advise(devices);
  REQUIRE(advice.size() == 1);
  CHECK_THAT(advice[0], Contains("cable"));
  devices[2].speed = Speed::kUnknown;
  CHECK(advise(devices).empty());
}

TEST_CASE("isochronous sensors that want more of a bus than it grants are named together") {
  std::vector<UsbDevice> devices{hub("usb1"), kinect("1-1"), webcam("1-2", 3072)};
  auto advice = advise(devices);
  REQUIRE(advice.size() == 1);
  CHECK_THAT(advice[0], Contains("Kinect camera at USB 1-1, camera at USB 1-2 share bus 1") && Contains("112 %"));
  devices[2].isochronous_bytes = 2320;  // together 6000: just granted
  CHECK(advise(devices).empty());
  devices[2].isochronous_bytes = 2321;
  CHECK(advise(devices).size() == 1);
  devices[2].bus = 2;  // of another controller
  CHECK(advise(devices).empty());
  devices[2].bus = 1;
  devices[2].speed = Speed::kSuper;  // a bus of its own beside the USB 2 one
  CHECK(advise(devices).empty());
}

TEST_CASE("a sensor on a hub without a supply may lack current") {
  std::vector<UsbDevice> devices{hub("usb1", Speed::kHigh, false), hub("1-1", Speed::kHigh, false), webcam("1-1.2", 0)};
  const auto advice = advise(devices);
  REQUIRE(advice.size() == 1);
  CHECK_THAT(advice[0], Contains("draws up to 500 mA") && Contains("hub at 1-1"));
  devices[1].self_powered = true;
  CHECK(advise(devices).empty());
  devices[2].path.set("1-2");  // in the computer itself
  CHECK(advise(devices).empty());
}

TEST_CASE("a watch tells what is there, what went, and that it came back") {
  FakeBus bus;
  bus.plugged = {hub("usb1"), device("1-2", 0x1d27, 0x0601), device("1-3", 1, 1)};
  UsbWatch watch(bus);
  CHECK(watch.report({}).state == hal::DeviceState::kStarting);
  watch.poll({});
  CHECK(watch.report({}).state == hal::DeviceState::kReady);
  CHECK_THAT(std::string(watch.report({}).detail.view()), Contains("depth sensor 1d27:0601 at 1-2"));
  watch.poll({milliseconds(500).ns});
  CHECK(bus.lists == 1);  // nothing changed
  const UsbDevice sensor = bus.plugged[1];
  bus.plugged.erase(bus.plugged.begin() + 1);
  ++bus.changed;
  watch.poll({milliseconds(1000).ns});
  CHECK(watch.report({}).state == hal::DeviceState::kLost);
  CHECK_THAT(std::string(watch.report({}).detail.view()), Contains("1d27:0601 at 1-2 went away; there is no sensor"));
  bus.plugged.push_back(sensor);
  ++bus.changed;
  watch.poll({milliseconds(1500).ns});
  CHECK(watch.report({}).state == hal::DeviceState::kReady);
  bus.plugged.pop_back();  // and nobody tells of it
  watch.poll({milliseconds(1700).ns});
  CHECK(watch.report({}).state == hal::DeviceState::kReady);
  watch.poll({milliseconds(11600).ns});
  CHECK(watch.report({}).state == hal::DeviceState::kLost);
}

TEST_CASE("a bus that cannot be listed is missing, with what to do") {
  FakeBus bus;
  bus.broken = true;
  UsbWatch watch(bus);
  watch.poll({});
  const hal::DeviceReport report = watch.report({});
  CHECK(report.state == hal::DeviceState::kMissing);
  CHECK_THAT(std::string(report.detail.view()), Contains("Access denied"));
  CHECK_FALSE(report.remedy.empty());
}

TEST_CASE("a reset is the last resort: late, ever later, and not for ever") {
  hal::LastResort resort(milliseconds(1000), 2);
  const auto at = [&](int ms) { return resort.due({milliseconds(ms).ns}); };
  CHECK_FALSE(at(5000));  // the silence begins
  CHECK_FALSE(at(5999));
  CHECK(at(6000));
  CHECK_FALSE(at(7999));
  CHECK(at(8000));
  CHECK_FALSE(at(60000));
  CHECK(resort.resets() == 2);
  resort.frame_came();
  CHECK_FALSE(at(61000));
  CHECK(at(62000));
}

TEST_CASE("only the sensors that are meant are reset") {
  FakeBus bus;
  bus.plugged = {hub("usb1"), device("1-2", 0x1d27, 0x0601), kinect("1-3.1"), device("1-3.2", 0x045e, 0x02b0)};
  CHECK(reset_sensors(bus, Part::kKinectCamera) == 1);
  CHECK(bus.resets == std::vector<std::string>{"1-3.1"});
  CHECK(reset_sensors(bus, Part::kDepthSensor) == 1);
  CHECK(reset_sensors(bus, Part::kColorCamera) == 0);
  bus.broken = true;
  CHECK(reset_sensors(bus, Part::kDepthSensor) == 0);
}

TEST_CASE("this computer's own bus can be asked, whatever hangs on it") {
  const auto bus = make_libusb_bus();
  if (!bus) return;  // no libusb here
  CHECK((*bus)->devices().has_value());
  CHECK((*bus)->changes() < 1000);
  CHECK_FALSE((*bus)->reset("99-1").has_value());
}
