#include "algorithms/mapping/frame_gate.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <vector>

namespace firstlook {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Frames of 8 x 6 pixels, good but for what a test breaks.
struct Stream {
  std::vector<std::uint16_t> pixels = std::vector<std::uint16_t>(48, 1500);
  int width = 8;
  double units_per_m = 1000;
  Pose pose = Pose::Identity();
  double stamp_s = 0;
  FrameGate gate{{.intrinsics = {8, 6, 8, 8, 3.5, 2.5}}};

  std::optional<FrameFlaw> next(double after_s = 0.1) {
    stamp_s += after_s;
    return gate.inspect({pixels.data(), width, 6}, units_per_m, Transform<Base, Depth>(pose), stamp_s);
  }
};

}  // namespace

TEST_CASE("a good frame passes, also one without a return, near one or far one", "[mapping]") {
  Stream stream;
  CHECK_FALSE(stream.next());
  for (const std::uint16_t value : std::vector<std::uint16_t>{0, 60, 300, 9000, 49000}) {
    std::ranges::fill(stream.pixels, value);
    CHECK_FALSE(stream.next());
  }
}

TEST_CASE("broken frames are told by kind", "[mapping][safety]") {
  Stream stream;
  REQUIRE_FALSE(stream.next());
  SECTION("size") {
    stream.width = 6;
    CHECK(stream.next() == FrameFlaw::kWrongSize);
  }
  SECTION("pose") {
    for (const double broken : {kNaN, std::numeric_limits<double>::infinity()}) {
      stream.pose.translation().y() = broken;
      CHECK(stream.next() == FrameFlaw::kBadPose);
    }
    stream.pose = Pose::Identity();
    stream.pose.linear()(1, 2) = kNaN;
    CHECK(stream.next() == FrameFlaw::kBadPose);
    stream.pose.linear() = 1.1 * Eigen::Matrix3d::Identity();
    CHECK(stream.next() == FrameFlaw::kBadPose);
  }
  SECTION("stamps") {
    CHECK(stream.next(0) == FrameFlaw::kStampBackwards);
    CHECK(stream.next(-0.05) == FrameFlaw::kStampBackwards);
    CHECK_FALSE(stream.next(0.1));
    CHECK(stream.next(-1) == FrameFlaw::kStampBackwards);
    stream.stamp_s = kNaN;
    CHECK(stream.next() == FrameFlaw::kStampBackwards);
  }
  SECTION("scale") {
    for (const double factor : {0.001, 1000.0, 0.0, -1.0, kNaN, std::numeric_limits<double>::infinity()}) {
      stream.units_per_m = 1000 * factor;
      INFO(factor);
      CHECK(stream.next() == FrameFlaw::kWrongScale);
    }
  }
  stream.pose = Pose::Identity();
  stream.width = 8;
  stream.units_per_m = 1000;
  stream.stamp_s = 1000;
  CHECK_FALSE(stream.next());  // a refused frame leaves nothing behind
}

TEST_CASE("infinite pixels become pixels without a return and are counted", "[mapping][safety]") {
  Stream stream;
  stream.pixels[3] = stream.pixels[7] = 65535;
  CHECK_FALSE(stream.next());
  CHECK(stream.pixels[3] == 0);
  CHECK(stream.pixels[4] == 1500);
  std::ranges::fill(stream.pixels, std::uint16_t{65535});
  CHECK_FALSE(stream.next());
  CHECK(stream.gate.infinite_pixels() == 50);
}

}  // namespace firstlook
