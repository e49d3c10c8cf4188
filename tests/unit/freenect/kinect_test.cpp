/// The Kinect against a libfreenect of our own, in real time.
#include "hal/freenect/kinect.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <thread>
#include <vector>

#include "tests/unit/freenect/fake_freenect.hpp"

using namespace firstlook;
using namespace firstlook::freenect;
using hal::DeviceState;
using test::fake_kinect;

namespace {

KinectOptions quick() {
  KinectOptions options;
  options.usb.color = true;
  options.stall = milliseconds(500);
  options.reopen = milliseconds(150);
  return options;
}

struct Rig {
  explicit Rig(const KinectOptions& options = quick()) {
    memory::reset_accounts();
    auto made = Kinect::make(kernel(), options);
    REQUIRE(made.has_value());
    kinect = std::move(*made);
  }
  [[nodiscard]] Instant now() const { return {kernel().monotonic_ns() - begin_ns}; }
  std::vector<hal::Frame> run(hal::FrameStream& stream, double for_s, std::size_t enough) {
    std::vector<hal::Frame> frames;
    const Instant end = now() + seconds(for_s);
    for (Instant t = now(); t < end && frames.size() < enough; t = now()) {
      if (const auto frame = stream.poll(t)) {
        CHECK(frame->stamp <= t);
        if (!frames.empty()) CHECK(frame->stamp > frames.back().stamp);
        frames.push_back(*frame);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return frames;
  }
  bool becomes(DeviceState state, double within_s) {
    const Instant end = now() + seconds(within_s);
    while (now() < end) {
      if (kinect->depth_report().report(now()).state == state) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  [[nodiscard]] std::string detail() const { return std::string(kinect->depth_report().report(now()).detail.view()); }
  std::int64_t begin_ns = kernel().monotonic_ns();
  std::unique_ptr<Kinect> kinect;
};

void mend() {
  auto& k = fake_kinect();
  k.usb = k.present = k.openable = true;
  k.stalled = k.color_stalled = false;
  k.skip_depth = 0;
  k.first_ticks = 0;
}

}  // namespace

TEST_CASE("both cameras of a Kinect deliver, unmirrored and in millimetres, its tilt is left alone", "[freenect]") {
  mend();
  fake_kinect().first_ticks = 0xFFFFFFFF - 20'000'000;  // its clock begins anew on the way
  {
    Rig rig;
    const auto depth = rig.run(rig.kinect->depth(), 4, 25);
    const auto color = rig.run(rig.kinect->color(), 4, 8);
    REQUIRE(depth.size() == 25);
    REQUIRE(color.size() == 8);
    CHECK(rig.becomes(DeviceState::kReady, 1));
    CHECK(rig.kinect->color_report().report(rig.now()).state == DeviceState::kReady);
    const double span_s = (depth.back().stamp - depth.front().stamp).seconds();
    CHECK(span_s == Approx((depth.back().sequence - depth.front().sequence) / 30.0).margin(0.05));
    std::vector<std::uint16_t> mm(kPixels);
    REQUIRE(rig.kinect->depth().read(depth.back(), {mm.data(), kWidth, kHeight}));
    for (std::size_t i = 1; i < kPixels; ++i) {
      if (mm[i] != 500) REQUIRE(mm[i] == mm[i - 1] + 1);
    }
    std::vector<std::uint8_t> gray(kPixels);
    REQUIRE(rig.kinect->color().read(color.back(), {gray.data(), kWidth, kHeight}));
    for (std::size_t i = 1; i < kPixels; ++i) REQUIRE(gray[i] == static_cast<std::uint8_t>(gray[i - 1] + 1));
    CHECK_FALSE(rig.kinect->color().delivers_color());
    CHECK_FALSE(rig.kinect->depth().read(depth.back(), {mm.data(), kWidth, kHeight / 2}));
    CHECK(fake_kinect().depth_in_mm);
    CHECK_FALSE(fake_kinect().mirrored);
    CHECK_FALSE(fake_kinect().automatic);
    CHECK(fake_kinect().led == 1);  // green
    CHECK(fake_kinect().tilts == 0);
  }
  CHECK(fake_kinect().led == 0);
  CHECK_FALSE(fake_kinect().is_open);
}

TEST_CASE("frames that do not come are counted by the Kinect's clock", "[freenect]") {
  mend();
  Rig rig;
  (void)rig.run(rig.kinect->depth(), 4, 5);
  const auto before = rig.kinect->depth().counters();
  fake_kinect().skip_depth = 4;
  (void)rig.run(rig.kinect->depth(), 4, 15);
  const auto after = rig.kinect->depth().counters();
  CHECK(after.lost - before.lost == 4);
}

TEST_CASE("a Kinect that stalls, in one camera or both, or goes away is lost and comes back", "[freenect]") {
  mend();
  Rig rig;
  REQUIRE(rig.run(rig.kinect->depth(), 4, 5).size() == 5);
  SECTION("stalls") {
    fake_kinect().stalled = true;
    CHECK(rig.becomes(DeviceState::kLost, 3));
    CHECK(rig.detail() == "no frame came for 0.5 s");
  }
  SECTION("its colour alone stalls") {
    fake_kinect().color_stalled = true;
    CHECK(rig.becomes(DeviceState::kLost, 3));
  }
  SECTION("is unplugged") {
    fake_kinect().present = false;
    CHECK(rig.becomes(DeviceState::kLost, 3));
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    CHECK(rig.detail() == "no Kinect is there");
  }
  mend();
  CHECK(rig.becomes(DeviceState::kReady, 4));
  CHECK(rig.run(rig.kinect->depth(), 4, 3).size() == 3);
}

TEST_CASE("a Kinect of which one camera stays silent is reset in the end", "[freenect]") {
  mend();
  std::atomic<int> resets{0};
  KinectOptions options = quick();
  options.last_resort = hal::LastResort(milliseconds(800), 1);
  options.reset = [&] {
    ++resets;
    fake_kinect().stalled = false;
  };
  Rig rig(options);
  CHECK(rig.run(rig.kinect->depth(), 4, 40).size() == 40);
  CHECK(resets == 0);
  fake_kinect().stalled = true;
  CHECK(rig.becomes(DeviceState::kLost, 3));
  CHECK(rig.becomes(DeviceState::kReady, 8));
  CHECK(resets == 1);
}

TEST_CASE("a Kinect that cannot be used says why", "[freenect]") {
  mend();
  KinectOptions options = quick();
  std::string expected;
  SECTION("no USB") {
    fake_kinect().usb = false;
    expected = "libfreenect does not start: no USB";
  }
  SECTION("none") {
    fake_kinect().present = false;
    expected = "no Kinect is there";
  }
  SECTION("not allowed") {
    fake_kinect().openable = false;
    expected = "it cannot be opened";
  }
  SECTION("another serial number") {
    options.usb.serial = "B1";
    expected = "it cannot be opened";
  }
  Rig rig(options);
  CHECK(rig.kinect->depth_report().report(rig.now()).state == DeviceState::kMissing);
  CHECK(rig.detail() == expected);
  CHECK_FALSE(rig.kinect->depth_report().report(rig.now()).remedy.empty());
  mend();
}
