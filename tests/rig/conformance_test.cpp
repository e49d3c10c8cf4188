/// What tests/conformance asks of every device, asked of the drivers above the guest's own kernel and libraries, in
/// real time. Which devices: FIRSTLOOK_RIG_CAMERAS ("/dev/video10 320 240 ..."), FIRSTLOOK_RIG_PANEL ("can1 STATUS
/// FIFO"); the depth camera is the first that OpenNI finds, and a recording that is made of it.
#include <OpenNI.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "hal/can/can_panel.hpp"
#include "hal/openni/openni_depth.hpp"
#include "hal/v4l2/threaded_camera.hpp"
#include "platform/linux/system_calls.hpp"
#include "platform/loop/clock.hpp"
#include "tests/rig/depth_window.hpp"
#include "tests/support/temporary_folder.hpp"

namespace firstlook::rig {
namespace {

std::string named(const char* variable) {
  const char* const value = std::getenv(variable);
  return value == nullptr ? "" : value;
}

/// The frames of some seconds, in the order in which they came.
std::vector<hal::Frame> frames_of(hal::FrameStream& camera, double for_s) {
  std::vector<hal::Frame> frames;
  RealClock clock;
  while (clock.now() < Instant{} + seconds(for_s)) {
    const Instant now = clock.now();
    if (const auto frame = camera.poll(now)) {
      CHECK(frame->stamp <= now);
      CHECK_FALSE(camera.poll(now).has_value());  // each once
      frames.push_back(*frame);
    }
    clock.sleep_until(camera.next_due());
  }
  return frames;
}

/// What holds of every camera: order, gaps that are counted, 32 frames held, sizes that are refused.
template <typename Pixel, typename Camera>
void check_camera(Camera& camera, double for_s) {
  const std::vector<hal::Frame> frames = frames_of(camera, for_s);
  REQUIRE(frames.size() > 12);
  std::uint64_t left_out = frames.front().sequence;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    CHECK(frames[i].stamp > frames[i - 1].stamp);
    CHECK(frames[i].sequence > frames[i - 1].sequence);
    left_out += frames[i].sequence - frames[i - 1].sequence - 1;
  }
  const hal::StreamCounters counters = camera.counters();
  CHECK(counters.frames >= frames.size());
  CHECK(counters.lost <= left_out + 1);
  const CameraIntrinsics& k = camera.intrinsics();
  std::vector<Pixel> once(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height)), again = once;
  REQUIRE(camera.read(frames.back(), ImageView<Pixel>{once.data(), k.width, k.height}));
  REQUIRE(camera.read(frames.back(), ImageView<Pixel>{again.data(), k.width, k.height}));
  CHECK(once == again);
  CHECK(std::ranges::any_of(once, [](Pixel pixel) { return pixel != 0; }));
  CHECK_FALSE(camera.read(frames.back(), ImageView<Pixel>{once.data(), k.width, k.height / 2}));
  if (frames.size() > 40) {
    const Status gone = camera.read(frames.front(), ImageView<Pixel>{once.data(), k.width, k.height});
    REQUIRE_FALSE(gone);
    CHECK(gone.error().fault == Fault::kFrameGone);
  }
}

openni::OpenNiDepthOptions depth_options(const std::string& uri) {
  openni::OpenNiDepthOptions options;
  options.sensor = {uri, kDepthWidth, kDepthHeight, 30};
  return options;
}

void record(const std::string& file, double for_s) {
  REQUIRE(::openni::OpenNI::initialize() == ::openni::STATUS_OK);
  ::openni::Device device;
  REQUIRE(device.open("rig://depth") == ::openni::STATUS_OK);
  ::openni::VideoStream depth;
  REQUIRE(depth.create(device, ::openni::SENSOR_DEPTH) == ::openni::STATUS_OK);
  ::openni::Recorder recorder;
  REQUIRE(recorder.create(file.c_str()) == ::openni::STATUS_OK);
  REQUIRE(recorder.attach(depth) == ::openni::STATUS_OK);
  REQUIRE(depth.start() == ::openni::STATUS_OK);
  REQUIRE(recorder.start() == ::openni::STATUS_OK);
  std::this_thread::sleep_for(std::chrono::duration<double>(for_s));
  recorder.stop();
  depth.stop();
  recorder.destroy();
}

}  // namespace

TEST_CASE("cameras of V4L2", "[camera]") {
  std::istringstream cameras(named("FIRSTLOOK_RIG_CAMERAS"));
  int asked = 0;
  std::string device;
  for (int width = 0, height = 0; cameras >> device >> width >> height; ++asked) {
    INFO(device);
    v4l2::V4l2CameraOptions options;
    options.capture.device = device;
    options.capture.width = width;
    options.capture.height = height;
    options.capture.formats.push_back(v4l2::PixelFormat::kYuyv);
    options.intrinsics = {width, height, 300, 300, width / 2.0, height / 2.0};
    auto camera = v4l2::ThreadedCamera::make(kernel(), options);
    REQUIRE(camera);
    check_camera<std::uint8_t>(**camera, 4);
    CHECK((*camera)->report({}).state == hal::DeviceState::kReady);
  }
  CHECK(asked > 0);
}

TEST_CASE("the depth camera below OpenNI, and a recording of it", "[depth]") {
  {
    auto live = openni::OpenNiDepth::make(kernel(), depth_options(""));
    REQUIRE(live);
    check_camera<std::uint16_t>(**live, 3);
    CHECK((*live)->units_per_m() == 1000);
    CHECK((*live)->report({}).state == hal::DeviceState::kReady);
  }
  const std::string kept = named("FIRSTLOOK_RIG_RECORDING");
  const test::TemporaryFolder folder("firstlook-rig");
  const std::string file = kept.empty() ? (folder.path() / "cell.oni").string() : kept;
  record(file, 6);
  auto played = openni::OpenNiDepth::make(kernel(), depth_options(file));
  REQUIRE(played);
  check_camera<std::uint16_t>(**played, 4);
  CHECK((*played)->intrinsics().fx > 50);
  CHECK((*played)->report({}).state == hal::DeviceState::kReady);
}

TEST_CASE("the panel on a real controller's driver", "[panel]") {
  std::istringstream words(named("FIRSTLOOK_RIG_PANEL"));
  can::CanPanelOptions options;
  std::string shown, buttons;
  REQUIRE(words >> options.io.interface >> shown >> buttons);
  can::CanPanel panel(kernel(), options);
  RealClock clock;
  std::vector<hal::OperatorAction> keys;
  const auto run = [&](double for_s, const auto& until) {
    const Instant end = clock.now() + seconds(for_s);
    for (Instant now = clock.now(); now < end; now = clock.now()) {
      if (const auto key = panel.poll(now)) {
        CHECK(key->stamp <= now);
        keys.push_back(key->action);
      }
      if (until()) return true;
      clock.sleep_until(panel.next_due());
    }
    return false;
  };
  const auto shows = [&](const std::string& lamp) {
    return [&shown, lamp] {
      std::string line;
      std::getline(std::ifstream(shown) >> std::ws, line);
      return line.find(lamp) != std::string::npos;
    };
  };
  const bool ready = run(6, [&] { return panel.report(clock.now()).state == hal::DeviceState::kReady; });
  INFO(panel.report(clock.now()).detail.view());
  REQUIRE(ready);
  panel.light(hal::Light::kAmber);
  CHECK(run(3, shows("amber")));
  panel.light(hal::Light::kGreen);
  CHECK(run(3, shows("green")));
  std::ofstream(buttons) << "press start" << std::endl;
  CHECK(run(3, [&] { return !keys.empty(); }));
  std::ofstream(buttons) << "release start" << std::endl;
  CHECK_FALSE(run(0.5, [] { return false; }));
  std::ofstream(buttons) << "press stop" << std::endl;
  CHECK(run(3, [&] { return keys.size() > 1; }));
  std::ofstream(buttons) << "release stop" << std::endl;
  CHECK(keys == std::vector<hal::OperatorAction>{hal::OperatorAction::kPlay, hal::OperatorAction::kStop});
  std::ofstream(buttons) << "power off" << std::endl;
  CHECK(run(3, [&] { return panel.report(clock.now()).state == hal::DeviceState::kLost; }));
  std::ofstream(buttons) << "power on" << std::endl;
  CHECK(run(6, [&] { return panel.report(clock.now()).state == hal::DeviceState::kReady; }));
}

}  // namespace firstlook::rig
