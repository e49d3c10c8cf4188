/// Devices that tell of themselves, as events of the loop.
#include "app/shell/device_source.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "app/shell/event_codec.hpp"

namespace firstlook {
namespace {

using hal::DeviceState;

class Teller final : public hal::ReportingDevice {
 public:
  [[nodiscard]] hal::DeviceReport report(Instant) const override { return told; }
  hal::DeviceReport told;
};

struct Devices {
  Devices() {
    camera.told.state = panel.told.state = DeviceState::kReady;
    telling.push_back({CartDevice::kColorCamera, &camera});
    telling.push_back({CartDevice::kPanel, &panel});
    source.emplace(telling);
  }
  /// What the source says within a second.
  std::vector<DeviceChanged> second() {
    std::vector<DeviceChanged> said;
    for (int turn = 0; turn < 125; ++turn) {
      now = now + milliseconds(8);
      REQUIRE(source->collect(now, queue));
      for (; !queue.empty(); queue.pop()) {
        const auto event = decode_event(queue.front().kind, queue.front().bytes());
        REQUIRE(event);
        said.push_back(std::get<DeviceChanged>(*event));
      }
    }
    return said;
  }
  Teller camera, panel;
  TellingDevices telling;
  std::optional<DeviceSource> source;
  EventQueue queue;
  Instant now{};
};

}  // namespace

TEST_CASE("a device that goes and comes back is an event each time, one that starts is as it was") {
  Devices d;
  CHECK(d.second().empty());
  CHECK_FALSE(d.source->take_news());
  d.panel.told.state = DeviceState::kLost;
  d.panel.told.remedy.set("Switch it on.");
  auto said = d.second();
  REQUIRE(said.size() == 1);
  CHECK(said[0].device == CartDevice::kPanel);
  CHECK_FALSE(said[0].present);
  CHECK(d.source->take_news());
  CHECK(d.source->told()[1].absent);
  CHECK(d.source->told()[1].changed);
  CHECK_FALSE(d.source->told()[0].absent);
  CHECK(d.second().empty());
  CHECK_FALSE(d.source->take_news());
  d.panel.told.state = DeviceState::kStarting;
  CHECK(d.second().empty());
  CHECK(d.source->told()[1].absent);
  d.panel.told.state = DeviceState::kReady;
  said = d.second();
  REQUIRE(said.size() == 1);
  CHECK(said[0].present);
  CHECK_FALSE(d.source->told()[1].absent);
}

TEST_CASE("another reason or remedy is news, figures of a device that works are none") {
  Devices d;
  (void)d.second();
  d.camera.told.add("frames", 7);
  d.camera.told.detail.set("30.0 frames a second");
  (void)d.second();
  CHECK_FALSE(d.source->take_news());
  d.camera.told.state = DeviceState::kMissing;
  (void)d.second();
  CHECK(d.source->take_news());
  d.camera.told.detail.set("another program uses it");
  CHECK(d.second().empty());
  CHECK(d.source->take_news());
}

TEST_CASE("nothing to watch is never due") {
  DeviceSource none{TellingDevices{}};
  EventQueue queue;
  CHECK(none.next_due() == kNever);
  REQUIRE(none.collect(Instant{} + seconds(3), queue));
  CHECK(queue.empty());
}

}  // namespace firstlook
