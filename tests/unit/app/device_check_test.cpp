/// `firstlook check` against scripted devices: how long it looks, what it believes, what it says.
#include "app/check/device_check.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "app/check/check_report.hpp"
#include "tests/support/mock_color_camera.hpp"
#include "tests/support/mock_depth_camera.hpp"
#include "tests/support/mock_panel.hpp"
#include "tests/support/mock_pendant.hpp"
#include "tests/support/mock_robot_arm.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using hal::DeviceState;

namespace {

/// A device that becomes ready, or never.
struct Telling final : hal::ReportingDevice {
  double ready_s = 1e9;
  [[nodiscard]] hal::DeviceReport report(Instant now) const override {
    hal::DeviceReport r;
    r.state = now.seconds() >= ready_s ? DeviceState::kReady : DeviceState::kMissing;
    r.device.set("can0 node 10");
    if (r.state != DeviceState::kReady) {
      r.detail.set("does not answer");
      r.remedy.set("Check the cable.");
    }
    r.add("losses", 3);
    return r;
  }
};

std::vector<DeviceCheck> only(std::string role, std::unique_ptr<WatchedDevice> device, bool simulated = false) {
  std::vector<DeviceCheck> checks;
  checks.push_back({std::move(role), simulated, std::move(device)});
  return checks;
}

double number(const hal::DeviceReport& report, std::string_view name) {
  for (const auto& n : report.numbers) {
    if (n.name == name) return n.value;
  }
  FAIL("no number " << name);
  return 0;
}

}  // namespace

TEST_CASE("streams, arm and operator's devices are watched for a second", "[check]") {
  mock::MockColorCamera camera;
  camera.lose(4);
  mock::MockRobotArm arm(JointVector{0, -1.5, 1, 0, 0, 0});
  mock::MockPendant pendant;
  mock::MockPanel panel;
  std::vector<DeviceCheck> checks;
  checks.push_back({"arm", true, watch_arm(arm, nullptr)});
  checks.push_back({"colour camera", true, watch_stream(camera, nullptr)});
  checks.push_back({"pendant", true, watch_pendant(pendant, nullptr)});
  checks.push_back({"panel", true, watch_panel(panel, nullptr)});
  VirtualClock clock;
  const CheckResult result{watch_devices(checks, clock), {}};
  CHECK(result.all_ready());
  CHECK(clock.now().seconds() > 1);
  CHECK(clock.now().seconds() < 1.5);
  const hal::DeviceReport& stream = result.devices[1].report;
  CHECK(number(stream, "rate_hz") == Approx(1 / 0.066).epsilon(0.15));
  CHECK(number(stream, "frames_lost") == 1);
  CHECK_THAT(std::string(stream.detail.view()), Contains("frames a second, 1 of "));
  CHECK(number(result.devices[0].report, "rate_hz") > 100);
}

TEST_CASE("a stream without frames, and an arm without reports or in a stop, are not ready", "[check]") {
  VirtualClock clock;
  SECTION("stream") {
    mock::MockColorCamera camera;
    camera.stall_at(Instant{});
    const CheckResult result{watch_devices(only("colour camera", watch_stream(camera, nullptr)), clock), {}};
    CHECK(result.devices[0].report.state == DeviceState::kMissing);
    CHECK(result.devices[0].report.detail.view() == "no frame came");
    CHECK_FALSE(result.all_ready());
    CHECK(clock.now().seconds() >= 6);  // it may have been starting
  }
  SECTION("arm") {
    mock::MockRobotArm arm(JointVector{0, -1.5, 1, 0, 0, 0});
    arm.at(Instant{seconds(0.01).ns}, [](mock::MockRobotArm& a) { a.set_safety(hal::ArmSafety::kProtectiveStop); });
    const CheckResult result{watch_devices(only("arm", watch_arm(arm, nullptr)), clock), {}};
    CHECK(result.devices[0].report.state == DeviceState::kUnsuitable);
    CHECK_THAT(std::string(result.devices[0].report.detail.view()), Contains("protective stop"));
    CHECK_FALSE(result.devices[0].report.remedy.empty());
  }
}

TEST_CASE("a depth camera that repeats its picture is not ready, one that sees little may", "[check]") {
  mock::MockDepthCamera camera;
  bool hangs = false;
  std::size_t returns = 64 * 48;
  camera.paint = [&](const hal::Frame& frame, ImageView<std::uint16_t> image) {
    std::ranges::fill(image.pixels(), std::uint16_t{0});
    std::ranges::fill(image.pixels().first(returns), std::uint16_t{1500});
    if (!hangs) ++image.at(static_cast<int>(frame.sequence % 64), 0);
  };
  VirtualClock clock;
  const auto checked = [&] {
    return watch_devices(only("depth camera", watch_depth(camera, nullptr)), clock).front().report;
  };
  SECTION("it lives") { CHECK(checked().state == DeviceState::kReady); }
  SECTION("it hangs") {
    hangs = true;
    const hal::DeviceReport report = checked();
    CHECK(report.state == DeviceState::kUnsuitable);
    CHECK_THAT(std::string(report.detail.view()), Contains("repeats one picture"));
    CHECK_THAT(std::string(report.remedy.view()), Contains("Restart the camera"));
  }
  SECTION("it looks into the open") {
    hangs = true;
    returns = 20;
    CHECK(checked().state == DeviceState::kReady);
  }
}

TEST_CASE("a device that tells of itself is believed, and given time to start", "[check]") {
  mock::MockPanel panel;
  Telling own;
  VirtualClock clock;
  SECTION("late") {
    own.ready_s = 4;
    const CheckResult result{watch_devices(only("panel", watch_panel(panel, &own)), clock), {}};
    CHECK(result.all_ready());
    CHECK(clock.now().seconds() == Approx(5).margin(0.2));
  }
  SECTION("never") {
    const CheckResult result{watch_devices(only("panel", watch_panel(panel, &own)), clock), {"mind the glass"}};
    CHECK_FALSE(result.all_ready());
    CHECK(check_text(result) ==
          "panel          missing     can0 node 10: does not answer\n"
          "               to do:      Check the cable.\n"
          "warning        mind the glass\n");
    const auto json = nlohmann::json::parse(check_json(result));
    CHECK(json["ok"] == false);
    CHECK(json["warnings"][0] == "mind the glass");
    const auto& device = json["devices"][0];
    CHECK(device["role"] == "panel");
    CHECK(device["state"] == "missing");
    CHECK(device["device"] == "can0 node 10");
    CHECK(device["remedy"] == "Check the cable.");
    CHECK(device["numbers"]["losses"] == 3);
    CHECK(device["simulated"] == false);
  }
}

TEST_CASE("a device that could not be made says why", "[check]") {
  VirtualClock clock;
  const Error error = failure(Fault::kOutOfMemory, "colour camera slots: too many bytes").error();
  const CheckResult result{watch_devices(only("colour camera", absent_device("/dev/video9", error)), clock), {}};
  CHECK_FALSE(result.all_ready());
  CHECK_THAT(check_text(result), Contains("/dev/video9: colour camera slots: too many bytes") &&
                                     Contains("to do:      32 frames are held: choose a smaller picture"));
}

TEST_CASE("the check asks for what no device can tell", "[check]") {
  Config config;
  CHECK_THAT(check_warnings(config, true).at(0), Contains("glass") && Contains("keep_out"));
  config.keep_out.push_back({{0, 0, 0}, {1, 1, 1}});
  CHECK(check_warnings(config, true).empty());
  config.start_source = "panel";
  CHECK(check_warnings(config, true).empty());
  CHECK_THAT(check_warnings(config, false).at(0), Contains("panel.can_interface"));
  config.panel.can_interface = "can0";
  CHECK(check_warnings(config, false).empty());
}
