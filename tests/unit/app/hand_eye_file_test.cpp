/// hand_eye.yaml: what a run writes a later one reads; every mistake in it is named with its line.
#include "app/dataset/hand_eye_file.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "tests/unit/app/sample_calibration.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;

namespace {

/// A file of this test, gone afterwards.
class File {
 public:
  explicit File(const std::string& text)
      : path_(std::filesystem::temp_directory_path() / ("firstlook_hand_eye_" + std::to_string(getpid()) + ".yaml")) {
    std::ofstream(path_, std::ios::binary) << text;
  }
  ~File() { std::filesystem::remove(path_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The sample's text with the line that begins with `key` replaced.
std::string with_line(const std::string& key, const std::string& line) {
  std::string text = hand_eye_yaml(sample_calibration());
  const std::size_t at = text.find("\n" + key) + 1;
  REQUIRE(at != std::string::npos + 1);
  return text.replace(at, text.find('\n', at) - at, line);
}

int line_of(const std::string& text, const std::string& key) {
  return 1 +
         static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find(key)), '\n'));
}

std::string refused(const std::string& text, Fault fault = Fault::kDataMalformed) {
  const File file(text);
  INFO(text);
  const auto read = read_hand_eye(file.path());
  REQUIRE_FALSE(read);
  CHECK(read.error().fault == fault);
  CHECK_THAT(std::string(read.error().detail()), Contains(file.path().string()));
  return std::string(read.error().detail());
}

std::string covariance_lines(const Matrix6d& covariance) {
  StoredCalibration c = sample_calibration();
  c.covariance = covariance;
  return hand_eye_yaml(c);
}

}  // namespace

TEST_CASE("a written calibration reads back whole", "[hand_eye_file]") {
  const StoredCalibration c = sample_calibration();
  const File file(hand_eye_yaml(c));
  const auto read = read_hand_eye(file.path());
  if (!read) FAIL(read.error().detail());
  CHECK(read->accepted);
  CHECK(read->arm_model == c.arm_model);
  CHECK(read->kinematics == c.kinematics);
  CHECK(pose_difference(read->flange_T_camera.pose(), c.flange_T_camera.pose()).norm() < 1e-15);
  CHECK(read->flange_T_camera.translation() == c.flange_T_camera.translation());
  CHECK((read->covariance - c.covariance).norm() < 1e-20);
  CHECK(read->corner_sigma_px == c.corner_sigma_px);
  CHECK(read->arm_sigma.translation_m == Approx(c.arm_sigma.translation_m));
  CHECK(read->arm_sigma.rotation_rad == Approx(c.arm_sigma.rotation_rad));
  CHECK(read->intrinsics == c.intrinsics);
  CHECK(pose_difference(read->camera_T_depth.value().pose(), c.camera_T_depth.value().pose()).norm() < 1e-15);
  CHECK(read->solver == c.solver);
  CHECK(read->views == 15);
  CHECK(read->views_given == 16);
  CHECK(read->reprojection_rms_px == c.reprojection_rms_px);
  CHECK(read->holdout_rms_px == c.holdout_rms_px);
  CHECK(read->usable_distance_m == c.usable_distance_m);
}

TEST_CASE("what a calibration estimated of depth camera and stamps reads back, and is compared as stated",
          "[hand_eye_file]") {
  StoredCalibration c = sample_calibration();
  const Transform<Camera, Depth> stated(Eigen::Quaterniond::Identity(), {-0.03, 0.001, 0});
  DepthMount mount;
  mount.camera_T_depth = *c.camera_T_depth;
  mount.depth_scale = 1.003;
  mount.covariance.diagonal() << 1e-8, 2e-8, 3e-8, 4e-8, 5e-8, 6e-8, 7e-8;
  c.depth_mount = mount;
  c.stated_camera_T_depth = stated;
  c.color_offset = {-0.0301, 1e-4};
  c.depth_offset = {0.002, 4e-4};
  const std::string text = hand_eye_yaml(c);
  const File file(text);
  const auto read = read_hand_eye(file.path());
  if (!read) FAIL(read.error().detail());
  REQUIRE(read->depth_mount);
  CHECK(read->depth_mount->depth_scale == 1.003);
  CHECK((read->depth_mount->covariance - mount.covariance).norm() < 1e-20);
  CHECK(pose_difference(read->depth_mount->camera_T_depth.pose(), mount.camera_T_depth.pose()).norm() < 1e-15);
  CHECK(read->color_offset->offset_s == -0.0301);
  CHECK(read->depth_offset->sigma_s == 4e-4);
  const ArmModel arm = *find_arm_model("ur5");
  CHECK(check_belongs(*read, arm, c.intrinsics, stated));
  CHECK_FALSE(check_belongs(*read, arm, c.intrinsics, *c.camera_T_depth));
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    return other.replace(other.find(from), from.size(), to);
  };
  CHECK_THAT(refused(changed("depth_scale: 1.003", "depth_scale: 3")), Contains("depth_scale"));
  CHECK_THAT(refused(changed("offset_s: -0.0301", "offset_s: -30.1")), Contains("offset_s"));
  CHECK_THAT(refused(changed("stated_translation_m: [-0.03", "stated_translation_m: [-30")), Contains("millimetres"));
}

TEST_CASE("a calibration that its own run rejected is refused, whatever else it says", "[hand_eye_file]") {
  StoredCalibration c = sample_calibration();
  c.accepted = false;
  c.covariance(0, 0) = std::numeric_limits<double>::quiet_NaN();
  c.holdout_rms_px = 0;
  CHECK_THAT(refused(hand_eye_yaml(c), Fault::kStoredCalibration), Contains("rejected by the run that made it"));
}

TEST_CASE("files that are none", "[hand_eye_file]") {
  CHECK(read_hand_eye("/nowhere/hand_eye.yaml").error().fault == Fault::kDataMissing);
  CHECK_FALSE(read_hand_eye(std::filesystem::temp_directory_path()));
  CHECK_THAT(refused(""), Contains("not a list of keys"));
  CHECK_THAT(refused("just words"), Contains(":1: not a list of keys"));
  CHECK_THAT(refused("[1, 2"), Contains(":1:"));
  CHECK_THAT(refused(with_line("verdict", "verdict: {accepted")), Contains(".yaml:"));
  CHECK_THAT(refused(std::string(100'000, 'x')), Contains("65536"));
  // What an older version wrote, or half a file.
  const std::string whole = hand_eye_yaml(sample_calibration());
  CHECK_THAT(refused(whole.substr(0, whole.find("usable_distance_m"))), Contains("no key usable_distance_m"));
}

TEST_CASE("keys: all of them, once, and no others", "[hand_eye_file]") {
  const std::string whole = hand_eye_yaml(sample_calibration());
  const std::string typo = with_line("verdict", "verdikt: accepted");
  CHECK_THAT(refused(typo),
             Contains(fmt::format(":{}:", line_of(typo, "verdikt"))) && Contains("'verdikt'; did you mean verdict?"));
  CHECK_THAT(refused(whole + "views: 3\n"), Contains("views is given twice"));
  CHECK_THAT(refused(with_line("  translation_m", "  translation: [0, 0, 0]")),
             Contains("'translation'; did you mean translation_m?"));
  CHECK_THAT(refused(with_line("format", "format: 2")), Contains(":3: format 2 is not known"));
}

TEST_CASE("values that cannot be", "[hand_eye_file]") {
  const auto check = [](const std::string& key, const std::string& line, const std::string& complaint) {
    const std::string text = with_line(key, line);
    CHECK_THAT(refused(text), Contains(fmt::format(":{}:", line_of(text, line))) && Contains(complaint));
  };
  check("verdict", "verdict: splendid", "accepted or rejected");
  check("parent_frame", "parent_frame: wrist_2_link", "'wrist_2_link'; only tool0");
  check("parent_frame", "parent_frame: camera_color_optical_frame", "only tool0");
  check("child_frame", "child_frame: camera_link", "only camera_color_optical_frame");
  check("translation_m", "translation_m: [1, -70, 60]", "looks like millimetres");
  check("translation_m", "translation_m: [.nan, 0, 0]", "finite number, not '.nan'");
  check("translation_m", "translation_m: [0, 0]", "list of 3 numbers");
  check("quaternion_xyzw", "quaternion_xyzw: [0, 0, 0, 0.99]", "norm 0.99");
  check("quaternion_xyzw", "quaternion_xyzw: [0, 0, 0, 5]", "norm 5 instead of 1");
  check("quaternion_xyzw", "quaternion_xyzw: [0, 0, .inf, 1]", "finite");
  check("quaternion_xyzw", "quaternion_xyzw: [0, 0, .nan, 1]", "finite");
  check("quaternion_xyzw", "quaternion_xyzw: [0, 0, 0, 0]", "norm 0 instead of 1");
  check("quaternion_xyzw", "quaternion_xyzw: [0, 0, 1]", "list of 4 numbers");

  check("kinematics", "kinematics: 12xy", "16 hexadecimal digits");
  check("corner_sigma_px", "corner_sigma_px: -1", "between 0 and 100");
  check("solver", "solver: guess", "'guess' is not known");
  check("views:", "views: 2", "views is 2");
  check("views:", "views: 8.5", "whole number");
  check("holdout_rms_px", "holdout_rms_px: nan", "finite");
  check("arm_model", "arm_model: []", "must be a word");
  check("intrinsics", "intrinsics: {image_width: 640, image_height: 480, fx_px: 0, fy_px: 538, cx_px: 320, cy_px: 240,",
        "intrinsics.fx_px is 0");
}

TEST_CASE("the pose of the flange in the camera is not taken for the pose of the camera in the flange",
          "[hand_eye_file]") {
  std::string text = hand_eye_yaml(sample_calibration());
  const auto swap_in = [&](const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    text.replace(at, from.size(), to);
  };
  swap_in("parent_frame: tool0", "parent_frame: camera_color_optical_frame");
  swap_in("child_frame: camera_color_optical_frame", "child_frame: tool0");
  CHECK_THAT(refused(text), Contains(fmt::format(":{}:", line_of(text, "parent_frame"))) &&
                                Contains("parent_frame and child_frame are swapped") && Contains("not its inverse"));
}

TEST_CASE("each key that is missing is named", "[hand_eye_file]") {
  const std::string whole = hand_eye_yaml(sample_calibration());
  for (const char* key : {"format", "verdict", "arm_model", "kinematics", "parent_frame", "child_frame",
                          "translation_m", "quaternion_xyzw", "sigma_translation_mm", "sigma_rotation_mrad",
                          "corner_sigma_px", "solver", "views", "reprojection_rms_px", "usable_distance_m"}) {
    const std::size_t at = whole.find(fmt::format("\n{}:", key)) + 1;
    std::string text = whole;
    text.erase(at, text.find('\n', at) + 1 - at);
    CHECK_THAT(refused(text), Contains(fmt::format("no key {}:", key)));
  }
}

TEST_CASE("a calibration of recorded data says what it cannot know, and no job takes it for more", "[hand_eye_file]") {
  StoredCalibration c = sample_calibration();
  c.camera_T_depth.reset();
  const ArmModel arm = *find_arm_model("ur5");
  const auto again = [](const StoredCalibration& calibration) {
    const File file(hand_eye_yaml(calibration));
    const auto read = read_hand_eye(file.path());
    if (!read) FAIL(read.error().detail());
    return *read;
  };
  CHECK_FALSE(again(c).camera_T_depth);
  // Nothing in it depends on the depth camera: that may be anywhere.
  CHECK(check_belongs(again(c), arm, c.intrinsics, Transform<Camera, Depth>({1, 0, 0, 0}, {0.1, 0, 0})));
  const auto why = [&](const StoredCalibration& calibration) {
    const Status status = check_belongs(again(calibration), arm, c.intrinsics, {});
    REQUIRE_FALSE(status);
    CHECK(status.error().fault == Fault::kStoredCalibration);
    return std::string(status.error().detail());
  };
  StoredCalibration pairs = c, nobody = c;
  pairs.intrinsics = {};
  CHECK_THAT(why(pairs), Contains("solved from pose pairs"));
  nobody.arm_model = kUnknownArm;
  nobody.kinematics = 0;
  CHECK_THAT(why(nobody), Contains("which arm") && Contains("--arm ur5"));
}

TEST_CASE("a covariance must be one, in metres and radians", "[hand_eye_file]") {
  Matrix6d c = sample_calibration().covariance;
  c(0, 5) += 1e-9;
  CHECK_THAT(refused(covariance_lines(c)), Contains("not symmetric: row 6 column 1"));
  c = sample_calibration().covariance;
  c(2, 4) = c(4, 2) = 1.01 * std::sqrt(c(2, 2) * c(4, 4));
  CHECK_THAT(refused(covariance_lines(c)), Contains("not positive definite"));
  c = sample_calibration().covariance;
  c(1, 1) = 0;
  CHECK_THAT(refused(covariance_lines(c)), Contains("not positive"));
  c = sample_calibration().covariance;
  c(3, 3) = -c(3, 3);
  CHECK_THAT(refused(covariance_lines(c)), Contains("not positive"));
  c = 1e6 * sample_calibration().covariance;  // mm^2 and mrad^2
  CHECK_THAT(refused(covariance_lines(c)), Contains("must be in m^2 and rad^2"));
  CHECK_THAT(refused(with_line("sigma_translation_mm", "sigma_translation_mm: [0.1, 0.2, 0.1]")),
             Contains("one of them was changed"));
}

TEST_CASE("a calibration belongs to its arm and its cameras", "[hand_eye_file]") {
  const StoredCalibration c = sample_calibration();
  const ArmModel arm = *find_arm_model("ur5");
  CHECK(check_belongs(c, arm, c.intrinsics, *c.camera_T_depth));
  const auto why = [&](const ArmModel& a, const CameraIntrinsics& k, const Transform<Camera, Depth>& depth) {
    const Status status = check_belongs(c, a, k, depth);
    REQUIRE_FALSE(status);
    CHECK(status.error().fault == Fault::kStoredCalibration);
    return std::string(status.error().detail());
  };
  CHECK_THAT(why(*find_arm_model("ur10e"), c.intrinsics, *c.camera_T_depth), Contains("ur5, this one is ur10e"));
  ArmModel corrected = arm;
  corrected.dh[1].a_m += 1e-4;
  CHECK_THAT(why(corrected, c.intrinsics, *c.camera_T_depth), Contains("other kinematics of the ur5"));
  CameraIntrinsics larger = c.intrinsics, other = c.intrinsics;
  larger.width = 800;
  CHECK_THAT(why(arm, larger, *c.camera_T_depth), Contains("640x480, the camera gives 800x480"));
  other.cy += 0.5;
  CHECK(check_belongs(c, arm, other, *c.camera_T_depth, true));  // a cart that estimates them
  CHECK_FALSE(check_belongs(c, arm, larger, *c.camera_T_depth, true));
  CHECK_THAT(why(arm, other, *c.camera_T_depth), Contains("0.5 px"));
  other = c.intrinsics;
  other.k2 += 0.001;
  CHECK_THAT(why(arm, other, *c.camera_T_depth), Contains("distortion by 0.001"));
  const Transform<Camera, Depth> moved(c.camera_T_depth->quaternion(), {-0.022, 0, 0});
  CHECK_THAT(why(arm, c.intrinsics, moved), Contains("3.00 mm"));
}

TEST_CASE("the kinematics checksum tells arms apart and forgives rounding", "[hand_eye_file]") {
  ArmModel arm = *find_arm_model("ur5");
  const std::uint64_t sum = kinematics_checksum(arm);
  CHECK(kinematics_checksum(*find_arm_model("ur5e")) != sum);
  arm.dh[3].d_m += 1e-12;
  CHECK(kinematics_checksum(arm) == sum);
  arm.dh[5].theta_offset_rad += 1e-6;
  CHECK(kinematics_checksum(arm) != sum);
}
