/// The camera against a simulated kernel, in virtual time: what drivers grant, lose, stamp and break.
#include "hal/v4l2/v4l2_camera.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "tests/support/jpeg_writer.hpp"
#include "tests/support/simulated_v4l2_kernel.hpp"

using namespace firstlook;
using namespace firstlook::v4l2;
using hal::DeviceState;

namespace {

constexpr int kWidth = 64, kHeight = 48;

/// YUYV in which every luma is 16 + the frame's number.
std::vector<std::uint8_t> yuyv(std::uint32_t number, int stride = 2 * kWidth) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(stride) * kHeight, 128);
  for (std::size_t i = 0; i < bytes.size(); i += 2) bytes[i] = static_cast<std::uint8_t>(16 + number % 200);
  return bytes;
}

V4l2CameraOptions small_camera() {
  V4l2CameraOptions options;
  options.capture.device = "/dev/v4l/by-id/usb-test-index0";
  options.capture.width = kWidth;
  options.capture.height = kHeight;
  options.capture.rate_hz = 25;
  options.capture.formats.push_back(PixelFormat::kYuyv);
  options.capture.formats.push_back(PixelFormat::kMjpeg);
  options.intrinsics = {kWidth, kHeight, 60, 60, 31.5, 23.5};
  options.exposure = milliseconds(10);
  return options;
}

struct Rig {
  explicit Rig(const V4l2CameraOptions& camera_options = small_camera()) : options(camera_options) {
    memory::reset_accounts();
    kernel.picture = [](std::uint32_t n) { return yuyv(n); };
    auto made = V4l2Camera::make(kernel, options);
    REQUIRE(made.has_value());
    camera = std::move(*made);
  }
  /// Polls whenever it is due.
  void run(double for_s) {
    for (const Instant end = now + seconds(for_s); now < end; now = now + milliseconds(1)) {
      kernel.set_now(now);
      if (camera->next_due() > now) continue;
      if (const auto frame = camera->poll(now)) frames.push_back(*frame);
    }
  }
  [[nodiscard]] int gray_of(const hal::Frame& frame) {
    std::vector<std::uint8_t> pixels(kWidth * kHeight);
    const Status status = camera->read(frame, {pixels.data(), kWidth, kHeight});
    REQUIRE(status.has_value());
    return pixels[100];
  }
  [[nodiscard]] DeviceState state() const { return camera->report(now).state; }
  [[nodiscard]] std::string detail() const { return std::string(camera->report(now).detail.view()); }
  [[nodiscard]] std::string remedy() const { return std::string(camera->report(now).remedy.view()); }

  test::SimulatedV4l2Kernel kernel;
  V4l2CameraOptions options;
  std::unique_ptr<V4l2Camera> camera;
  Instant now{};
  std::vector<hal::Frame> frames;
};

}  // namespace

TEST_CASE("frames come at the driver's rate, stamped at the middle of their exposure", "[v4l2][camera]") {
  Rig rig;
  CHECK(rig.state() == DeviceState::kStarting);
  rig.run(2);
  REQUIRE(rig.frames.size() == 49);
  for (std::size_t i = 0; i < rig.frames.size(); ++i) {
    CHECK(rig.frames[i].sequence == i);
    // The stamp is that of the begin of the exposure: 20 ms before the buffer is there.
    const Instant begin = Instant{} + milliseconds(40) * (static_cast<std::int64_t>(i) + 1) - milliseconds(20);
    CHECK(std::abs((rig.frames[i].stamp - (begin + milliseconds(5))).ns) <=
          1000);  // microseconds of the kernel's stamps
  }
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.detail() == "Test camera (test), 64 x 48 YUYV");
  CHECK(rig.camera->counters().lost == 0);
  CHECK(rig.gray_of(rig.frames[30]) == 35);  // 30 steps of 255 / 219
}

TEST_CASE("stamps: end of frame, unknown, later than now, of another clock", "[v4l2][camera]") {
  Rig rig;
  const auto age_ms = [&](const hal::Frame& frame, std::size_t number) {
    return (Instant{} + milliseconds(40) * (static_cast<std::int64_t>(number) + 1) - frame.stamp).seconds() * 1e3;
  };
  SECTION("end of frame") {
    rig.kernel.stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
    rig.run(0.5);
    CHECK(age_ms(rig.frames.at(5), 5) == Approx(20 + 5).margin(0.01));
  }
  SECTION("unknown, as v4l2loopback gives them") {
    rig.kernel.stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
    rig.kernel.stamp_shift_ns = -99'000'000'000;
    rig.run(0.5);
    CHECK(age_ms(rig.frames.at(5), 5) == Approx(5).margin(1.1));  // the moment of taking less half the exposure
    CHECK(rig.detail().find("of no known clock") != std::string::npos);
  }
  SECTION("later than now, as vivid gives them") {
    rig.kernel.stamp_shift_ns = 30'000'000;
    rig.run(0.5);
    CHECK(rig.camera->more_counters().stamps_late > 5);
    for (std::size_t i = 0; i < rig.frames.size(); ++i) CHECK(age_ms(rig.frames[i], i) == Approx(0).margin(1.1));
  }
  SECTION("of another clock") {
    rig.kernel.stamp_shift_ns = 1'700'000'000'000'000'000;  // of the date
    rig.run(0.5);
    CHECK(rig.camera->more_counters().stamps_unusable > 5);
    CHECK(age_ms(rig.frames.at(5), 5) == Approx(5).margin(1.1));
  }
  REQUIRE(rig.frames.size() > 5);
  for (std::size_t i = 1; i < rig.frames.size(); ++i) CHECK(rig.frames[i].stamp > rig.frames[i - 1].stamp);
}

TEST_CASE("what the driver does not deliver is counted as lost", "[v4l2][camera]") {
  Rig rig;
  SECTION("gaps") {
    rig.kernel.lost = {3, 4, 10};
    rig.run(1);
    CHECK(rig.camera->more_counters().gaps == 2);
    CHECK(rig.frames.at(3).sequence == 5);
  }
  SECTION("gaps over the end of the numbers") {
    rig.kernel.first_sequence = 0xFFFFFFFF - 3;
    rig.kernel.lost = {3, 4, 10};
    rig.run(1);
    CHECK(rig.frames.at(3).sequence == 5);
  }
  SECTION("flagged and cut ones") {
    rig.kernel.broken = {3, 4};
    rig.kernel.cut = {10};
    rig.run(1);
    CHECK(rig.camera->more_counters().broken == 3);
    CHECK(rig.camera->more_counters().gaps == 0);
  }
  const hal::StreamCounters counters = rig.camera->counters();
  CHECK(counters.lost == 3);
  CHECK(counters.frames == 24);
  CHECK(rig.frames.size() == 21);
  CHECK(rig.frames.back().sequence == 23);
}

TEST_CASE("a loop that comes late gets the newest that the kernel kept, and the rest is counted", "[v4l2][camera]") {
  Rig rig;
  rig.run(0.5);
  const auto before = rig.camera->counters();
  rig.now = rig.now + milliseconds(500);  // twelve frames, four buffers
  rig.kernel.set_now(rig.now);
  rig.frames.clear();
  rig.run(0.2);
  CHECK(rig.frames.size() >= 4);
  const auto after = rig.camera->counters();
  CHECK(after.lost - before.lost >= 8);
  CHECK(rig.state() == DeviceState::kReady);
}

TEST_CASE("the last 32 frames are held", "[v4l2][camera]") {
  Rig rig;
  rig.run(3);
  const std::size_t n = rig.frames.size();
  REQUIRE(n > 40);
  CHECK(rig.gray_of(rig.frames[n - 1]) > 0);
  CHECK(rig.gray_of(rig.frames[n - 32]) > 0);
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  const Status gone = rig.camera->read(rig.frames[n - 33], {pixels.data(), kWidth, kHeight});
  REQUIRE_FALSE(gone.has_value());
  CHECK(gone.error().fault == Fault::kFrameGone);
}

TEST_CASE("pictures up to full HD are held, and larger ones refused with the numbers", "[v4l2][camera]") {
  V4l2CameraOptions options = small_camera();
  options.capture.width = options.intrinsics.width = 1920;
  options.capture.height = options.intrinsics.height = 1080;
  SECTION("full HD") {
    Rig rig(options);
    rig.kernel.picture = [](std::uint32_t n) {
      return std::vector<std::uint8_t>(std::size_t{2} * 1920 * 1080, static_cast<std::uint8_t>(16 + n));
    };
    rig.run(1);
    const std::size_t n = rig.frames.size();
    REQUIRE(n > 10);
    std::vector<std::uint8_t> pixels(std::size_t{1920} * 1080);
    const ImageView<std::uint8_t> view{pixels.data(), 1920, 1080};
    for (std::size_t back = 1; back <= 6; ++back) CHECK(rig.camera->read(rig.frames[n - back], view).has_value());
    const Status gone = rig.camera->read(rig.frames[n - 7], view);
    REQUIRE_FALSE(gone.has_value());
    CHECK(gone.error().fault == Fault::kFrameGone);
  }
  SECTION("more") {
    memory::reset_accounts();
    options.capture.width = 2560;
    test::SimulatedV4l2Kernel kernel;
    const auto refused = V4l2Camera::make(kernel, options);
    REQUIRE_FALSE(refused.has_value());
    CHECK(refused.error().fault == Fault::kOutOfMemory);
    CHECK(refused.error().detail() ==
          "colour camera slots: frames of 5529600 bytes; the largest that fit have 4147200");
  }
}

TEST_CASE("the granted format is used, padding and all, one of another size is refused by name", "[v4l2][camera]") {
  Rig rig;
  SECTION("longer rows") {
    rig.kernel.grant = [](v4l2_pix_format& pix) { pix.bytesperline = 2 * kWidth + 32; };
    rig.kernel.picture = [](std::uint32_t n) { return yuyv(n, 2 * kWidth + 32); };
    rig.run(1);
    CHECK(rig.state() == DeviceState::kReady);
    CHECK(rig.gray_of(rig.frames.at(20)) == 23);
  }
  SECTION("the second format") {
    rig.kernel.formats = {V4L2_PIX_FMT_MJPEG};
    const std::vector<std::array<std::uint8_t, 3>> white(kWidth * kHeight, {255, 255, 255});
    const auto jpeg = test::without_huffman_tables(test::write_jpeg({white.data(), kWidth, kHeight}));
    rig.kernel.picture = [jpeg](std::uint32_t) { return jpeg; };
    rig.run(1);
    CHECK(rig.detail() == "Test camera (test), 64 x 48 MJPG");
    CHECK(rig.gray_of(rig.frames.at(20)) == 255);
  }
  SECTION("another size") {  // as vivid answers 320x240 with 320x180
    rig.kernel.grant = [](v4l2_pix_format& pix) { pix.height = 36; };
    rig.run(1);
    CHECK(rig.state() == DeviceState::kUnsuitable);
    CHECK(rig.detail() == "asked for 64 x 48, it grants 64 x 36 in MJPG");
    CHECK(rig.remedy().find("camera.height") != std::string::npos);
    CHECK(rig.frames.empty());
    CHECK_FALSE(rig.kernel.is_open());
  }
  SECTION("another format") {
    rig.kernel.formats = {V4L2_PIX_FMT_H264};
    rig.run(1);
    CHECK(rig.state() == DeviceState::kUnsuitable);
    CHECK(rig.detail() == "asked for 64 x 48, it grants 64 x 48 in H264");
  }
  SECTION("one buffer") {
    rig.kernel.buffers_granted = 1;
    rig.run(1);
    CHECK(rig.state() == DeviceState::kUnsuitable);
    CHECK(rig.detail() == "it grants fewer than two buffers");
  }
  SECTION("a device of metadata") {
    rig.kernel.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
    rig.run(1);
    CHECK(rig.state() == DeviceState::kUnsuitable);
    CHECK(rig.remedy().find("index0") != std::string::npos);
  }
}

TEST_CASE("a device that is absent, forbidden or busy says what to do, and is used once it is there",
          "[v4l2][camera]") {
  Rig rig;
  SECTION("absent") {
    rig.kernel.present = false;
    rig.run(1);
    CHECK(rig.detail() == "there is no such device");
    CHECK(rig.remedy().find("/dev/v4l/by-id") != std::string::npos);
  }
  SECTION("forbidden") {
    rig.kernel.open_error = EACCES;
    rig.run(1);
    CHECK(rig.remedy().find("group video") != std::string::npos);
  }
  SECTION("busy") {
    rig.kernel.refuse[VIDIOC_REQBUFS] = EBUSY;
    rig.run(1);
    CHECK(rig.detail() == "another program uses it");
  }
  SECTION("no bandwidth") {
    rig.kernel.refuse[VIDIOC_STREAMON] = ENOSPC;
    rig.run(1);
    CHECK(rig.detail().find("VIDIOC_STREAMON: No space left") != std::string::npos);
  }
  CHECK(rig.state() == DeviceState::kMissing);
  CHECK(rig.kernel.mapped() == 0);
  rig.kernel.present = true;
  rig.kernel.open_error = 0;
  rig.kernel.refuse.clear();
  rig.run(4);
  CHECK(rig.state() == DeviceState::kReady);
}

TEST_CASE("no call that fails leaves anything open or mapped", "[v4l2][camera]") {
  for (const unsigned long request : {VIDIOC_QUERYCAP, VIDIOC_S_FMT, VIDIOC_S_PARM, VIDIOC_REQBUFS, VIDIOC_QUERYBUF,
                                      VIDIOC_QBUF, VIDIOC_STREAMON, VIDIOC_DQBUF}) {
    Rig rig;
    rig.kernel.refuse[request] = EIO;
    rig.run(1);
    INFO(request);
    if (request == VIDIOC_S_PARM) {  // its answer is a wish
      CHECK(rig.state() == DeviceState::kReady);
      continue;
    }
    CHECK(rig.state() != DeviceState::kReady);
    if (!rig.kernel.is_open()) CHECK(rig.kernel.mapped() == 0);
    rig.kernel.refuse.clear();
    rig.run(10);
    CHECK(rig.state() == DeviceState::kReady);
  }
}

TEST_CASE("an unplugged camera is lost, and comes back by its path", "[v4l2][camera]") {
  Rig rig;
  rig.run(1);
  const std::uint32_t last = rig.frames.back().sequence;
  const Instant stamp = rig.frames.back().stamp;
  rig.kernel.unplug();
  rig.run(5);
  CHECK(rig.state() == DeviceState::kLost);
  CHECK(rig.detail() == "there is no such device");
  CHECK(rig.camera->more_counters().disconnects == 1);
  CHECK_FALSE(rig.kernel.is_open());
  CHECK(rig.kernel.mapped() == 0);
  CHECK(rig.gray_of(rig.frames.back()) > 0);  // what it gave is still held
  rig.frames.clear();
  rig.kernel.present = true;
  rig.run(9);
  CHECK(rig.state() == DeviceState::kReady);
  REQUIRE_FALSE(rig.frames.empty());
  CHECK(rig.frames.front().sequence == last + 1);
  CHECK(rig.frames.front().stamp > stamp);
}

TEST_CASE("another camera in its place is not taken for it", "[v4l2][camera]") {
  Rig rig;
  rig.run(1);
  rig.kernel.unplug();
  rig.run(1);
  rig.kernel.present = true;
  rig.kernel.formats = {V4L2_PIX_FMT_MJPEG};
  rig.run(9);
  CHECK(rig.state() == DeviceState::kUnsuitable);
  CHECK(rig.detail() == "another camera, or another format, came back in its place");
}

TEST_CASE("a stream that stops without a word is found by our own clock", "[v4l2][camera]") {
  Rig rig;
  rig.run(1);
  rig.kernel.stalled = true;
  rig.run(1.2);
  CHECK(rig.state() == DeviceState::kLost);
  CHECK(rig.detail() == "no frame came for 1.0 s");
  rig.run(20);
  CHECK(rig.state() == DeviceState::kLost);
  CHECK(rig.camera->more_counters().stalls >= 3);
  CHECK(rig.kernel.opens() <= 8);  // further and further apart
  rig.kernel.stalled = false;
  rig.run(10);
  CHECK(rig.state() == DeviceState::kReady);
}

TEST_CASE("a feeder that hangs behind a loopback stays lost, although each opening brings its last frame again",
          "[v4l2][camera]") {
  Rig rig;
  rig.run(1);
  rig.kernel.stalled = true;
  rig.kernel.keeps_last = true;
  rig.run(1.2);
  CHECK(rig.state() == DeviceState::kLost);
  rig.frames.clear();
  for (int i = 0; i < 100; ++i) {
    rig.run(0.2);
    CHECK(rig.state() == DeviceState::kLost);
  }
  CHECK(rig.frames.empty());
  CHECK(rig.kernel.opens() > 2);
  rig.kernel.stalled = false;
  rig.run(10);
  CHECK(rig.state() == DeviceState::kReady);
  CHECK_FALSE(rig.frames.empty());
}

TEST_CASE("a disturbed signal is survived, one that stays is opened again", "[v4l2][camera]") {
  Rig rig;
  rig.run(1);
  rig.kernel.input_errors = 3;
  rig.run(0.5);
  CHECK(rig.kernel.opens() == 1);
  CHECK(rig.camera->more_counters().input_errors == 3);
  CHECK(rig.state() == DeviceState::kReady);
  rig.kernel.input_errors = 12;
  rig.run(3);
  CHECK(rig.kernel.opens() == 2);
  CHECK(rig.state() == DeviceState::kReady);
}

TEST_CASE("controls hold still while it streams, and are put back", "[v4l2][camera]") {
  V4l2CameraOptions options = small_camera();
  options.capture.controls = fixed_controls(12500, 4, 40, 4600);
  Rig rig(options);
  rig.kernel.controls = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY},
                         {V4L2_CID_EXPOSURE_ABSOLUTE, 250},
                         {V4L2_CID_GAIN, 64},
                         {V4L2_CID_FOCUS_AUTO, 1},
                         {V4L2_CID_FOCUS_ABSOLUTE, 7},
                         {V4L2_CID_AUTO_WHITE_BALANCE, 1},
                         {V4L2_CID_WHITE_BALANCE_TEMPERATURE, 4000}};
  rig.kernel.limits = {{V4L2_CID_WHITE_BALANCE_TEMPERATURE, 4200}};
  const auto before = rig.kernel.controls;
  rig.run(1);
  CHECK(rig.kernel.controls[V4L2_CID_EXPOSURE_AUTO] == V4L2_EXPOSURE_MANUAL);
  CHECK(rig.kernel.controls[V4L2_CID_EXPOSURE_ABSOLUTE] == 125);
  CHECK(rig.kernel.controls[V4L2_CID_GAIN] == 4);
  CHECK(rig.kernel.controls[V4L2_CID_FOCUS_ABSOLUTE] == 40);
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(
      rig.detail() ==
      "Test camera (test), 64 x 48 YUYV; constant rate is not there, manual gain is not there, white balance is 4200");
  rig.camera.reset();
  CHECK(rig.kernel.controls == before);
}

TEST_CASE("the real kernel's camera, where one is named", "[v4l2][device]") {
  const char* const device = std::getenv("FIRSTLOOK_TEST_CAMERA");
  if (device == nullptr) {
    WARN("skipped: FIRSTLOOK_TEST_CAMERA names no device of V4L2");
    return;
  }
  memory::reset_accounts();
  V4l2CameraOptions options = small_camera();
  options.capture.device = device;
  options.capture.width = 640;
  options.capture.height = 480;
  options.intrinsics.width = 640;
  options.intrinsics.height = 480;
  auto camera = V4l2Camera::make(kernel(), options);
  REQUIRE(camera.has_value());
  const std::int64_t begin_ns = kernel().monotonic_ns();
  int frames = 0;
  Instant now{};
  while (now < Instant{} + seconds(5)) {
    now = {kernel().monotonic_ns() - begin_ns};
    if ((*camera)->next_due() <= now && (*camera)->poll(now)) ++frames;
  }
  CHECK(frames > 20);
  CHECK((*camera)->report(now).state == DeviceState::kReady);
}
