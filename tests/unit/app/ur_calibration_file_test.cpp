#include "app/config/ur_calibration_file.hpp"

#include <catch2/catch.hpp>
#include <optional>

#include "platform/core/random.hpp"
#include "tests/support/ur_correction.hpp"

namespace firstlook {
using Catch::Matchers::Contains;

namespace {

/// A robot as a factory measures it: its second and third axes are not quite parallel, and frames lie far along them.
ArmModel measured(const char* model, std::uint64_t seed) {
  ArmModel arm = *find_arm_model(model);
  Random random(seed, 7701);
  for (std::size_t j = 0; j < 6; ++j) {
    DhRow& row = arm.dh[j];
    row.theta_offset_rad += 1e-4 * random.normal();
    row.d_m += 2e-4 * random.normal();
    if (j == 5) continue;
    row.a_m += 2e-4 * random.normal();
    row.alpha_rad += 5e-4 * random.normal();
  }
  const double far_m = random.uniform(-20, 20);
  arm.dh[1].d_m += far_m;
  arm.dh[2].d_m -= far_m + 0.3;
  arm.dh[3].d_m += 0.3;
  return arm;
}

}  // namespace

TEST_CASE("a file of calibration_correction puts the flange where the controller's table has it", "[config]") {
  const std::string model = GENERATE("ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e");
  const auto seed = GENERATE(range(1, 6));
  const ArmModel arm = measured(model.c_str(), static_cast<std::uint64_t>(seed));
  const auto file = parse_ur_calibration(test::UrCorrection(std::span(arm.dh).first(6)).yaml("calib_1"), "robot.yaml");
  REQUIRE(file);
  CHECK(file->hash == "calib_1");
  const ArmModel published = *find_arm_model(model);
  const MeasuredArm read = with_factory_frames(published, file->frames);
  const FlangeDifference off = flange_difference(read.arm, arm);
  CHECK(off.m < 1e-9);
  CHECK(off.rad < 1e-7);  // of an angle near 0 by its cosine
  CHECK(flange_difference(published, arm).m > 1e-4);
  // And so do the links: as with the controller's table itself.
  const MeasuredArm told = with_factory_axes(published, arm.dh);
  CHECK(read.frames_off_m == Approx(told.frames_off_m).margin(1e-9));
}

TEST_CASE("the published kinematics as a file are the published arm", "[config]") {
  const ArmModel arm = *find_arm_model("ur10e");
  const auto file = parse_ur_calibration(test::UrCorrection(std::span(arm.dh).first(6)).yaml(""), "robot.yaml");
  REQUIRE(file);
  CHECK(file->hash.empty());
  CHECK(flange_difference(with_factory_frames(arm, file->frames).arm, arm).m < 1e-12);
}

TEST_CASE("rotations are put together as they were taken apart, not as a URDF's", "[config]") {
  // Some degrees about each axis at the forearm: the two readings lie apart there.
  ArmModel arm = measured("ur5", 3);
  arm.dh[1].theta_offset_rad = 0.1;
  arm.dh[1].alpha_rad = 0.08;
  const auto file = parse_ur_calibration(test::UrCorrection(std::span(arm.dh).first(6)).yaml(""), "robot.yaml");
  REQUIRE(file);
  CHECK(flange_difference(with_factory_frames(*find_arm_model("ur5"), file->frames).arm, arm).m < 1e-9);
}

TEST_CASE("hashes are those that the driver writes", "[config]") {
  // From ur_description, config/ur10e/default_kinematics.yaml.
  CHECK(ur_calibration_hash(std::span(find_arm_model("ur10e")->dh).first(6)) == "calib_5119701370761913513");
  ArmModel other = *find_arm_model("ur10e");
  other.dh[2].a_m += 1e-4;
  CHECK(ur_calibration_hash(std::span(other.dh).first(6)) != "calib_5119701370761913513");
}

TEST_CASE("what is no such file is refused with its place", "[config]") {
  const ArmModel arm = measured("ur5", 1);
  const std::string good = test::UrCorrection(std::span(arm.dh).first(6)).yaml("");
  const auto refused = [](const std::string& text, const char* word) {
    const auto read = parse_ur_calibration(text, "robot.yaml");
    REQUIRE_FALSE(read);
    CHECK(read.error().fault == Fault::kConfigBadValue);
    CHECK_THAT(std::string(read.error().detail()), Contains("robot.yaml") && Contains(word));
  };
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  refused("", "kinematics");
  refused("kinematics: 3\n", "kinematics");
  refused("- a\n", "kinematics");
  refused("kinematics: {\n", "robot.yaml:");
  refused(with("  wrist_2:", "  wrist_9:"), "wrist_2");
  refused(with("    roll:", "    rol:"), "shoulder.roll");
  refused(with("    x: 0\n", "    x: 0.1\n"), "axis 1");
  refused(with("    x: 0\n", "    x: 425\n"), "shoulder.x");
  refused(with("    x: 0\n", "    x: .nan\n"), "shoulder.x");
  const auto missing = read_ur_calibration("/nowhere/robot.yaml");
  REQUIRE_FALSE(missing);
  CHECK(missing.error().fault == Fault::kDataMissing);
}

}  // namespace firstlook
