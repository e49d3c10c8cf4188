#include "platform/journal/archive.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <vector>

using namespace firstlook;

namespace {

enum class Color : std::uint16_t { kRed = 1, kBlue = 300 };

struct Inner {
  bool yes = false;
  float ratio = 0;
  template <typename Archive>
  void fields(Archive& a) {
    a(yes, ratio);
  }
  bool operator==(const Inner&) const = default;
};

struct Outer {
  std::int8_t small = 0;
  std::uint64_t large = 0;
  double number = 0;
  Color color = Color::kRed;
  Instant when{};
  Duration span{};
  JointVector joints;
  std::array<double, 3> point{};
  FixedVector<Inner, 4> list;
  FixedVector<std::array<float, 2>, 8> corners;
  template <typename Archive>
  void fields(Archive& a) {
    a(small, large, number, color, when, span, joints, point, list, corners);
  }
};

struct Nothing {
  template <typename Archive>
  void fields(Archive&) {}
};

Outer example() {
  Outer o;
  o.small = -3;
  o.large = 0xfedcba9876543210ULL;
  o.number = -1.0 / 3;
  o.color = Color::kBlue;
  o.when = Instant{-7};
  o.span = seconds(2.5);
  o.joints = {1, 2, 3, 4, 5, 6};
  o.point = {0.1, std::numeric_limits<double>::infinity(), -0.0};
  o.list.push_back({true, 1.5F});
  o.list.push_back({false, -2.5F});
  o.corners.push_back({3.0F, 4.0F});
  return o;
}

}  // namespace

TEST_CASE("a value comes back as it was, without padding in its bytes") {
  std::array<std::byte, 512> buffer;
  const Outer in = example();
  const std::size_t size = pack(in, buffer);
  CHECK(size == 1 + 8 + 8 + 2 + 8 + 8 + (1 + 6 * 8) + 24 + (4 + 2 * 5) + (4 + 8));
  Outer out;
  REQUIRE(unpack(std::span<const std::byte>(buffer).first(size), out));
  CHECK(out.small == in.small);
  CHECK(out.large == in.large);
  CHECK(out.number == in.number);
  CHECK(out.color == in.color);
  CHECK(out.when == in.when);
  CHECK(out.span == in.span);
  CHECK(out.joints == in.joints);
  CHECK(out.point == in.point);
  REQUIRE(out.list.size() == 2);
  CHECK(out.list[0] == in.list[0]);
  CHECK(out.list[1] == in.list[1]);
  REQUIRE(out.corners.size() == 1);
  CHECK(out.corners[0] == in.corners[0]);
}

TEST_CASE("numbers are little-endian") {
  std::array<std::byte, 8> buffer{};
  REQUIRE(pack(std::uint32_t{0x01020304}, buffer) == 4);
  CHECK(buffer[0] == std::byte{4});
  CHECK(buffer[3] == std::byte{1});
}

TEST_CASE("any cut is refused, and so is one byte too many") {
  std::array<std::byte, 512> buffer{};
  const std::size_t size = pack(example(), buffer);
  for (std::size_t cut = 0; cut < size; ++cut) {
    Outer out;
    CHECK_FALSE(unpack(std::span<const std::byte>(buffer).first(cut), out));
    CHECK(pack(example(), std::span(buffer).first(cut)) == 0);
  }
  Outer out;
  CHECK_FALSE(unpack(std::span<const std::byte>(buffer).first(size + 1), out));
}

TEST_CASE("values that cannot be are refused") {
  bool flag = false;
  CHECK_FALSE(unpack(std::vector{std::byte{2}}, flag));
  FixedVector<std::uint8_t, 2> list;
  CHECK_FALSE(unpack(
      std::vector{std::byte{3}, std::byte{0}, std::byte{0}, std::byte{0}, std::byte{1}, std::byte{1}, std::byte{1}},
      list));
  JointVector joints;
  std::vector<std::byte> eight_joints(1 + 8 * 8);
  eight_joints[0] = std::byte{8};
  CHECK_FALSE(unpack(eight_joints, joints));
  std::array<std::byte, 128> buffer;
  joints.count = 9;
  CHECK(pack(joints, buffer) == 0);
}

TEST_CASE("a type without fields takes no bytes") {
  Nothing nothing;
  CHECK(pack(nothing, {}) == 0);
  CHECK(unpack({}, nothing));
}
