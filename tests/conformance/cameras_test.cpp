/// What every camera must do, whoever implements it.
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "hal/v4l2/v4l2_camera.hpp"
#include "tests/conformance/simulated_devices.hpp"
#include "tests/support/mock_color_camera.hpp"
#include "tests/support/mock_depth_camera.hpp"
#include "tests/support/simulated_v4l2_kernel.hpp"

using namespace firstlook;

namespace {

Instant at(double t_s) { return Instant{seconds(t_s).ns}; }

/// Each fixture: a camera that runs well, and one that loses some frames.
struct SimulatedColor {
  using Pixel = std::uint8_t;
  std::unique_ptr<sim::SimulatedCell> cell = test::empty_cell(), lossy_cell = test::empty_cell("color.drop=0.3");
  hal::ColorCamera& camera = cell->color();
  hal::ColorCamera& lossy = lossy_cell->color();
};
struct SimulatedDepth {
  using Pixel = std::uint16_t;
  std::unique_ptr<sim::SimulatedCell> cell = test::empty_cell(), lossy_cell = test::empty_cell("depth.drop=0.3");
  hal::DepthCamera& camera = cell->depth();
  hal::DepthCamera& lossy = lossy_cell->depth();
};
template <typename Camera, typename PixelType>
struct Mock {
  using Pixel = PixelType;
  Mock() {
    for (std::uint32_t n = 2; n < 60; n += 3) lossy.lose(n);
  }
  Camera camera, lossy;
};
using MockColor = Mock<mock::MockColorCamera, std::uint8_t>;
struct MockWithColors : MockColor {
  MockWithColors() { camera.color = std::array<std::uint8_t, 3>{camera.gray, camera.gray, camera.gray}; }
};
using MockDepth = Mock<mock::MockDepthCamera, std::uint16_t>;

/// The V4L2 driver above a simulated kernel, whose time is that of the polls.
class DrivenCamera final : public hal::ColorCamera {
 public:
  DrivenCamera() {
    v4l2::V4l2CameraOptions options;
    options.capture.device = kernel_.path;
    options.capture.width = kWidth;
    options.capture.height = kHeight;
    options.capture.formats.push_back(v4l2::PixelFormat::kYuyv);
    options.intrinsics = {kWidth, kHeight, 60, 60, 31.5, 23.5};
    kernel_.picture = [](std::uint32_t n) {
      std::vector<std::uint8_t> bytes(2 * kWidth * kHeight, 128);
      for (std::size_t i = 0; i < bytes.size(); i += 2) bytes[i] = static_cast<std::uint8_t>(20 + (i / 8 + n) % 200);
      return bytes;
    };
    camera_ = std::move(*v4l2::V4l2Camera::make(kernel_, options));
    REQUIRE_FALSE(camera_->poll(at(0)).has_value());  // opens it
  }
  void lose(std::uint32_t sequence) { kernel_.lost.insert(sequence); }
  const CameraIntrinsics& intrinsics() const override { return camera_->intrinsics(); }
  std::optional<hal::Frame> poll(Instant now) override {
    kernel_.set_now(now);
    return camera_->poll(now);
  }
  Instant next_due() const override { return camera_->next_due(); }
  hal::StreamCounters counters() const override { return camera_->counters(); }
  Status read(const hal::Frame& frame, MutableGrayImage image) override { return camera_->read(frame, image); }
  bool delivers_color() const override { return camera_->delivers_color(); }
  Status read_color(const hal::Frame& frame, ImageView<std::array<std::uint8_t, 3>> image) override {
    return camera_->read_color(frame, image);
  }
  std::optional<hal::CornerObservation> read_corners(const hal::Frame& frame, int target) override {
    return camera_->read_corners(frame, target);
  }

 private:
  static constexpr int kWidth = 64, kHeight = 48;
  test::SimulatedV4l2Kernel kernel_;
  std::unique_ptr<v4l2::V4l2Camera> camera_;
};
using DrivenColor = Mock<DrivenCamera, std::uint8_t>;

template <typename Pixel>
struct Image {
  explicit Image(const CameraIntrinsics& i)
      : width(i.width),
        height(i.height),
        pixels(static_cast<std::size_t>(i.width) * static_cast<std::size_t>(i.height)) {}
  ImageView<Pixel> view() { return {pixels.data(), width, height}; }
  int width, height;
  std::vector<Pixel> pixels;
};

}  // namespace

TEMPLATE_TEST_CASE("a camera keeps the order of its frames and never delivers the future", "[hal][camera]",
                   SimulatedColor, SimulatedDepth, MockColor, MockDepth, DrivenColor) {
  TestType device;
  Instant last{-1};
  std::optional<std::uint32_t> sequence;
  int frames = 0;
  while (device.camera.next_due() <= at(2)) {
    const Instant now = device.camera.next_due();
    const auto frame = device.camera.poll(now);
    REQUIRE(frame.has_value());
    CHECK(frame->stamp <= now);
    CHECK(frame->stamp > last);
    if (sequence) CHECK(frame->sequence == *sequence + 1);
    CHECK_FALSE(device.camera.poll(now).has_value());  // each once
    CHECK(device.camera.next_due() > now);
    last = frame->stamp;
    sequence = frame->sequence;
    ++frames;
  }
  CHECK(frames >= 20);
  CHECK(device.camera.counters().frames == static_cast<std::uint64_t>(frames));
  CHECK(device.camera.counters().lost == 0);
}

TEMPLATE_TEST_CASE("a camera that is polled late gives its newest frame", "[hal][camera]", SimulatedColor,
                   SimulatedDepth, MockColor, MockDepth) {
  TestType device;
  const auto frame = device.camera.poll(at(1));
  REQUIRE(frame.has_value());
  CHECK(frame->stamp > at(0.85));
  CHECK(frame->sequence > 10);
}

TEMPLATE_TEST_CASE("lost frames leave gaps in the sequence and are counted", "[hal][camera]", SimulatedColor,
                   SimulatedDepth, MockColor, MockDepth, DrivenColor) {
  TestType device;
  std::uint64_t received = 0;
  std::uint32_t last = 0;
  while (device.lossy.next_due() <= at(3)) {
    if (const auto frame = device.lossy.poll(device.lossy.next_due())) {
      ++received;
      last = frame->sequence;
    }
  }
  const hal::StreamCounters counters = device.lossy.counters();
  CHECK(counters.lost > 3);
  CHECK(received + counters.lost == counters.frames);
  CHECK(received < last);
}

TEMPLATE_TEST_CASE("a camera holds its last 32 frames, and says when one is gone", "[hal][camera]", SimulatedColor,
                   SimulatedDepth, MockColor, MockDepth, DrivenColor) {
  TestType device;
  std::vector<hal::Frame> frames;
  while (frames.size() < 150) {
    if (const auto frame = device.camera.poll(device.camera.next_due())) frames.push_back(*frame);
  }
  Image<typename TestType::Pixel> image(device.camera.intrinsics());
  CHECK(device.camera.read(frames[frames.size() - 1], image.view()).has_value());
  CHECK(device.camera.read(frames[frames.size() - 32], image.view()).has_value());
  const Status gone = device.camera.read(frames[0], image.view());
  REQUIRE_FALSE(gone.has_value());
  CHECK(gone.error().fault == Fault::kFrameGone);
}

TEMPLATE_TEST_CASE("reading is repeatable and refuses an image of the wrong size", "[hal][camera]", SimulatedColor,
                   SimulatedDepth, MockColor, MockDepth, DrivenColor) {
  TestType device;
  const auto frame = device.camera.poll(at(1));
  REQUIRE(frame.has_value());
  const CameraIntrinsics& intrinsics = device.camera.intrinsics();
  REQUIRE(intrinsics.width > 0);
  REQUIRE(intrinsics.fx > 0);
  Image<typename TestType::Pixel> once(intrinsics), again(intrinsics);
  REQUIRE(device.camera.read(*frame, once.view()).has_value());
  REQUIRE(device.camera.read(*frame, again.view()).has_value());
  CHECK(once.pixels == again.pixels);
  CHECK(std::ranges::any_of(once.pixels, [](auto pixel) { return pixel != 0; }));
  ImageView<typename TestType::Pixel> wrong = once.view();
  wrong.height /= 2;
  CHECK_FALSE(device.camera.read(*frame, wrong).has_value());
}

TEMPLATE_TEST_CASE("a camera with colours gives them as it gives grey values, a grey one says that it has none",
                   "[hal][camera]", SimulatedColor, MockColor, MockWithColors, DrivenColor) {
  TestType device;
  const auto frame = device.camera.poll(at(1));
  REQUIRE(frame.has_value());
  Image<std::array<std::uint8_t, 3>> once(device.camera.intrinsics()), again(device.camera.intrinsics());
  if (!device.camera.delivers_color()) {
    CHECK_FALSE(device.camera.read_color(*frame, once.view()).has_value());
    return;
  }
  Image<std::uint8_t> gray(device.camera.intrinsics());
  REQUIRE(device.camera.read_color(*frame, once.view()).has_value());
  REQUIRE(device.camera.read_color(*frame, again.view()).has_value());
  REQUIRE(device.camera.read(*frame, gray.view()).has_value());
  CHECK(once.pixels == again.pixels);
  double difference = 0;  // ITU-R BT.601 makes the one of the other, up to noise
  for (std::size_t i = 0; i < gray.pixels.size(); ++i) {
    const auto& [red, green, blue] = once.pixels[i];
    difference += std::abs(0.299 * red + 0.587 * green + 0.114 * blue - gray.pixels[i]);
  }
  CHECK(difference / static_cast<double>(gray.pixels.size()) < 3);
  auto wrong = once.view();
  wrong.width /= 2;
  CHECK_FALSE(device.camera.read_color(*frame, wrong).has_value());
  hal::Frame gone = *frame;
  gone.sequence += 1000;
  const Status missing = device.camera.read_color(gone, once.view());
  REQUIRE_FALSE(missing.has_value());
  CHECK(missing.error().fault == Fault::kFrameGone);
}

TEMPLATE_TEST_CASE("depth is in the units that the camera states", "[hal][camera]", SimulatedDepth, MockDepth) {
  TestType device;
  const auto frame = device.camera.poll(at(1));
  REQUIRE(frame.has_value());
  Image<std::uint16_t> image(device.camera.intrinsics());
  REQUIRE(device.camera.read(*frame, image.view()).has_value());
  for (const std::uint16_t pixel : image.pixels) {
    if (pixel == 0) continue;
    const double depth_m = pixel / device.camera.units_per_m();
    CHECK((depth_m > 0.3 && depth_m < 8));
  }
}
