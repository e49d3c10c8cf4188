/// The camera on its own thread, in real time: the loop never waits for it, and late is newest.
#include "hal/v4l2/threaded_camera.hpp"

#include <catch2/catch.hpp>
#include <thread>
#include <vector>

#include "platform/linux/wakeup.hpp"
#include "tests/support/simulated_v4l2_kernel.hpp"

using namespace firstlook;
using namespace firstlook::v4l2;
using hal::DeviceState;

namespace {

constexpr int kWidth = 64, kHeight = 48;

struct Rig {
  Rig() {
    memory::reset_accounts();
    kernel.real_time = true;
    kernel.picture = [](std::uint32_t n) {
      return std::vector<std::uint8_t>(2 * kWidth * kHeight, static_cast<std::uint8_t>(16 + n % 200));
    };
    V4l2CameraOptions options;
    options.capture.device = kernel.path;
    options.capture.width = kWidth;
    options.capture.height = kHeight;
    options.capture.formats.push_back(PixelFormat::kYuyv);
    options.intrinsics = {kWidth, kHeight, 60, 60, 31.5, 23.5};
    auto made = ThreadedCamera::make(kernel, options);
    REQUIRE(made.has_value());
    camera = std::move(*made);
  }
  [[nodiscard]] Instant now() const { return {monotonic_ns() - begin_ns}; }
  void run(double for_s) {
    for (const Instant end = now() + seconds(for_s); now() < end;) {
      const Instant t = now();
      if (camera->next_due() <= t) {
        if (const auto frame = camera->poll(t)) {
          CHECK(frame->stamp <= t);
          frames.push_back(*frame);
        }
        longest_s = std::max(longest_s, (now() - t).seconds());
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  test::SimulatedV4l2Kernel kernel;
  std::int64_t begin_ns = monotonic_ns();
  std::unique_ptr<ThreadedCamera> camera;
  std::vector<hal::Frame> frames;
  double longest_s = 0;
};

}  // namespace

TEST_CASE("the loop does not wait while a camera is opened", "[v4l2][thread]") {
  Rig rig;
  rig.kernel.open_takes = milliseconds(700);
  rig.run(0.4);
  CHECK(rig.frames.empty());
  CHECK(rig.camera->report(rig.now()).state == DeviceState::kStarting);
  rig.run(1.6);
  CHECK(rig.longest_s < 0.3);  // far below the opening, far above a busy computer's hiccups
  CHECK(rig.frames.size() > 10);
  CHECK(rig.camera->report(rig.now()).state == DeviceState::kReady);
  for (std::size_t i = 1; i < rig.frames.size(); ++i) {
    CHECK(rig.frames[i].sequence > rig.frames[i - 1].sequence);
    CHECK(rig.frames[i].stamp > rig.frames[i - 1].stamp);
  }
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  CHECK(rig.camera->read(rig.frames.back(), {pixels.data(), kWidth, kHeight}));
  CHECK(rig.camera->delivers_color());
}

TEST_CASE("a loop that comes late gets the newest frame", "[v4l2][thread]") {
  Rig rig;
  rig.run(0.5);
  std::this_thread::sleep_for(std::chrono::milliseconds(800));
  const Instant now = rig.now();
  const auto frame = rig.camera->poll(now);
  REQUIRE(frame.has_value());
  CHECK((now - frame->stamp).seconds() < 0.4);
  CHECK(frame->sequence > 15);
}
