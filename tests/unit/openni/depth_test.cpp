/// The depth camera against the real library with a driver of our own below it, and against a recording made with the
/// library's own recorder. In real time: the library has its own threads and clocks.
#include "hal/openni/openni_depth.hpp"

#include <OpenNI.h>
#include <dlfcn.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <thread>
#include <vector>

#include "tests/support/openni_driver/test_depth.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace firstlook;
using firstlook::hal::DeviceClock;
using firstlook::openni::OpenNiDepth;
using firstlook::openni::OpenNiDepthOptions;
using hal::DeviceState;

namespace {

constexpr int kWidth = test::kTestDepthWidth, kHeight = test::kTestDepthHeight;

OpenNiDepthOptions small_sensor() {
  OpenNiDepthOptions options;
  options.sensor = {test::kTestDepthUri, kWidth, kHeight, 30};
  options.stall = milliseconds(600);
  options.reopen = milliseconds(200);
  return options;
}

/// The sensor in the driver: the library has loaded it by then.
test::TestDepth& virtual_sensor() {
  REQUIRE(::openni::OpenNI::initialize() == ::openni::STATUS_OK);
  void* const driver = dlopen(FIRSTLOOK_OPENNI_DRIVER, RTLD_NOW | RTLD_NOLOAD);
  INFO("the library did not load " << FIRSTLOOK_OPENNI_DRIVER);
  REQUIRE(driver != nullptr);
  auto* const sensor = static_cast<test::TestDepth*>(dlsym(driver, "firstlook_test_depth"));
  REQUIRE(sensor != nullptr);
  if (!sensor->present) sensor->plug();
  sensor->stalled = sensor->always_mirrored = sensor->always_registered = false;
  sensor->skip = 0;
  return *sensor;
}

struct Rig {
  explicit Rig(const OpenNiDepthOptions& options = small_sensor()) {
    memory::reset_accounts();
    auto made = OpenNiDepth::make(kernel(), options);
    REQUIRE(made.has_value());
    camera = std::move(*made);
  }
  [[nodiscard]] Instant now() const { return {kernel().monotonic_ns() - begin_ns}; }
  /// Polls until `enough` frames came, or the time is over.
  void run(double for_s, std::size_t enough = SIZE_MAX) {
    const Instant end = now() + seconds(for_s);
    frames.clear();
    for (Instant t = now(); t < end && frames.size() < enough; t = now()) {
      if (const auto frame = camera->poll(t)) {
        CHECK(frame->stamp <= t);
        if (!frames.empty()) CHECK(frame->stamp > frames.back().stamp);
        frames.push_back(*frame);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  bool becomes(DeviceState state, double within_s) {
    const Instant end = now() + seconds(within_s);
    for (Instant t = now(); t < end; t = now()) {
      (void)camera->poll(t);
      if (camera->report(t).state == state) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  [[nodiscard]] std::string detail() const { return std::string(camera->report(now()).detail.view()); }
  std::vector<std::uint16_t> pixels_of(const hal::Frame& frame) {
    std::vector<std::uint16_t> pixels(static_cast<std::size_t>(kWidth * kHeight));
    REQUIRE(camera->read(frame, {pixels.data(), kWidth, kHeight}));
    return pixels;
  }

  std::int64_t begin_ns = kernel().monotonic_ns();
  std::unique_ptr<OpenNiDepth> camera;
  std::vector<hal::Frame> frames;
};

/// Which frame of the sensor it shows; every pixel must be of it.
int shown(const std::vector<std::uint16_t>& pixels) {
  const int frame = pixels[0] - test::test_depth_mm(0, 0, 0);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (pixels[static_cast<std::size_t>(y * kWidth + x)] !=
          test::test_depth_mm(static_cast<std::uint32_t>(frame), x, y)) {
        return -1;
      }
    }
  }
  return frame;
}

}  // namespace

TEST_CASE("frames come unmirrored, in millimetres, with intrinsics by the field of view", "[openni]") {
  virtual_sensor();
  Rig rig;
  rig.run(3, 20);
  REQUIRE(rig.frames.size() == 20);
  CHECK(rig.camera->report(rig.now()).state == DeviceState::kReady);
  CHECK(rig.camera->units_per_m() == 1000);
  const CameraIntrinsics& k = rig.camera->intrinsics();
  CHECK(k.fx == Approx(kWidth / 2.0 / std::tan(test::kTestHorizontalFov_rad / 2)));
  CHECK(k.fy == Approx(kHeight / 2.0 / std::tan(test::kTestVerticalFov_rad / 2)));
  CHECK(k.cx == (kWidth - 1) / 2.0);
  const int first = shown(rig.pixels_of(rig.frames.front())), last = shown(rig.pixels_of(rig.frames.back()));
  CHECK(first >= 0);
  CHECK((last - first + 50) % 50 == static_cast<int>(rig.frames.back().sequence - rig.frames.front().sequence) % 50);
  // Stamps are of the sensor's clock, whatever the delay until we looked.
  const double span_s = (rig.frames.back().stamp - rig.frames.front().stamp).seconds();
  CHECK(span_s == Approx((rig.frames.back().sequence - rig.frames.front().sequence) / 30.0).margin(0.05));
  std::vector<std::uint16_t> other(kWidth);
  CHECK_FALSE(rig.camera->read(rig.frames.back(), {other.data(), kWidth, 1}));
}

TEST_CASE("a sensor that stays mirrored is mirrored back, one that stays registered is refused", "[openni]") {
  test::TestDepth& sensor = virtual_sensor();
  SECTION("mirrored") {
    sensor.always_mirrored = true;
    Rig rig;
    rig.run(3, 3);
    REQUIRE(rig.frames.size() == 3);
    CHECK(shown(rig.pixels_of(rig.frames.back())) >= 0);
    CHECK(rig.detail().find("mirrored back") != std::string::npos);
  }
  SECTION("registered") {
    sensor.always_registered = true;
    Rig rig;
    CHECK(rig.becomes(DeviceState::kUnsuitable, 3));
  }
}

TEST_CASE("frames that are not delivered are counted as lost", "[openni]") {
  test::TestDepth& sensor = virtual_sensor();
  Rig rig;
  rig.run(3, 5);
  const auto before = rig.camera->counters();
  sensor.skip = 4;
  rig.run(3, 15);
  const auto after = rig.camera->counters();
  CHECK(after.lost - before.lost >= 4);
  CHECK(after.lost - before.lost < 15);
}

TEST_CASE("a stalled sensor is found by our own clock, and used again when it goes on", "[openni]") {
  test::TestDepth& sensor = virtual_sensor();
  Rig rig;
  rig.run(3, 5);
  sensor.stalled = true;
  CHECK(rig.becomes(DeviceState::kLost, 3));
  CHECK(rig.detail() == "no frame came for 0.6 s");
  sensor.stalled = false;
  CHECK(rig.becomes(DeviceState::kReady, 4));
  CHECK(rig.camera->more_counters().opens >= 2);
}

TEST_CASE("a sensor that stays silent however often it is opened is reset, one that gives frames is not", "[openni]") {
  test::TestDepth& sensor = virtual_sensor();
  std::atomic<int> resets{0};
  OpenNiDepthOptions options = small_sensor();
  options.last_resort = hal::LastResort(milliseconds(1000), 1);
  options.reset = [&] {
    ++resets;
    sensor.stalled = false;  // that helped
  };
  Rig rig(options);
  rig.run(3, 60);
  CHECK(resets == 0);
  sensor.stalled = true;
  CHECK(rig.becomes(DeviceState::kLost, 3));
  CHECK(rig.becomes(DeviceState::kReady, 8));
  CHECK(resets == 1);
  CHECK(rig.camera->more_counters().resets == 1);
}

TEST_CASE("a sensor that is unplugged is lost although its driver goes on, and comes back", "[openni]") {
  test::TestDepth& sensor = virtual_sensor();
  Rig rig;
  rig.run(3, 5);
  REQUIRE_FALSE(rig.frames.empty());
  const std::uint32_t last = rig.frames.back().sequence;
  sensor.unplug();
  CHECK(rig.becomes(DeviceState::kLost, 3));
  CHECK(rig.detail().find("cannot be opened") != std::string::npos);
  sensor.plug();
  CHECK(rig.becomes(DeviceState::kReady, 4));
  rig.run(3, 3);
  REQUIRE(rig.frames.size() == 3);
  CHECK(rig.frames.front().sequence > last);
}

TEST_CASE("another size, no such device, too large: said with what to do", "[openni]") {
  virtual_sensor();
  OpenNiDepthOptions options = small_sensor();
  SECTION("size") {
    options.sensor.width = 32;
    Rig rig(options);
    CHECK(rig.camera->report(rig.now()).state == DeviceState::kUnsuitable);
    CHECK(rig.detail() == "it has no depth of 32 x 48, but 64 x 48");
  }
  SECTION("device") {
    options.sensor.uri = "firstlook://nothing";
    Rig rig(options);
    CHECK(rig.camera->report(rig.now()).state == DeviceState::kMissing);
    CHECK_FALSE(rig.camera->report(rig.now()).remedy.empty());
  }
  SECTION("memory") {
    options.sensor.width = 1920;
    options.sensor.height = 1080;
    memory::reset_accounts();
    const auto made = OpenNiDepth::make(kernel(), options);
    REQUIRE_FALSE(made.has_value());
    CHECK(made.error().fault == Fault::kOutOfMemory);
  }
}

TEST_CASE("a recording plays once, frame by frame, and says that it has ended", "[openni]") {
  virtual_sensor();
  const test::TemporaryFolder folder("firstlook-oni");
  const std::string file = (folder.path() / "cell.oni").string();
  {
    ::openni::Device device;
    REQUIRE(device.open(test::kTestDepthUri) == ::openni::STATUS_OK);
    ::openni::VideoStream depth;
    REQUIRE(depth.create(device, ::openni::SENSOR_DEPTH) == ::openni::STATUS_OK);
    REQUIRE(depth.setMirroringEnabled(false) == ::openni::STATUS_OK);
    ::openni::Recorder recorder;
    REQUIRE(recorder.create(file.c_str()) == ::openni::STATUS_OK);
    REQUIRE(recorder.attach(depth) == ::openni::STATUS_OK);
    REQUIRE(depth.start() == ::openni::STATUS_OK);
    REQUIRE(recorder.start() == ::openni::STATUS_OK);
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    recorder.stop();
    depth.stop();
    recorder.destroy();
    depth.destroy();
    device.close();
  }
  OpenNiDepthOptions options = small_sensor();
  options.sensor.uri = file;
  Rig rig(options);
  rig.run(2.2);
  CHECK(rig.frames.size() >= 30);
  int wrong = 0;
  for (std::size_t i = rig.frames.size() > 30 ? rig.frames.size() - 30 : 0; i < rig.frames.size(); ++i) {
    wrong += shown(rig.pixels_of(rig.frames[i])) < 0;
  }
  CHECK(wrong == 0);
  CHECK(rig.becomes(DeviceState::kLost, 3));
  CHECK(rig.detail() == "the recording has ended");
  CHECK(rig.camera->intrinsics().fx == Approx(kWidth / 2.0 / std::tan(test::kTestHorizontalFov_rad / 2)).epsilon(1e-3));
}

TEST_CASE("a device's clock: delays come off, drift is followed, a step begins anew", "[openni][clock]") {
  DeviceClock clock;
  std::int64_t worst = 0;
  for (int i = 0; i < 20000; ++i) {  // ten minutes with 50 ppm of drift
    const std::int64_t device = 33'000'000LL * i;
    const std::int64_t truth = 77'000'000'000LL + device + device / 20'000;
    const std::int64_t delay = 3'000'000LL + (i * 7919 % 23) * 1'000'000LL;
    const std::int64_t told = clock.ours_ns(device, truth + delay);
    CHECK(told <= truth + delay);
    if (i > 100) worst = std::max(worst, std::abs(told - truth - 3'000'000));
  }
  CHECK(worst < 200'000);
  const std::int64_t anew = clock.ours_ns(0, 99'000'000'000'000);
  CHECK(anew == 99'000'000'000'000);
}
