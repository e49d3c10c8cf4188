#include "app/dataset/calibration_dataset.hpp"

#include <png.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

// jpeglib.h needs <cstdio> before it.
#include <jpeglib.h>
#include <yaml-cpp/yaml.h>

#include "algorithms/calibration/verdict.hpp"
#include "app/cli/calibrate_command.hpp"
#include "app/dataset/hand_eye_file.hpp"
#include "app/dataset/picture_file.hpp"
#include "tests/support/recorded_data.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"
#include "tests/unit/vision/draw_board.hpp"

using namespace firstlook;
using test::DataFolder;
using test::Setup;
namespace fs = std::filesystem;

namespace {

const std::string kPairsHeader =
    "flange_x,flange_y,flange_z,flange_qx,flange_qy,flange_qz,flange_qw,"
    "board_x,board_y,board_z,board_qx,board_qy,board_qz,board_qw\n";

/// Writes a data set with corners and returns its views.
std::vector<CalibrationView> write_corners(const DataFolder& folder, const Setup& setup, int count) {
  Random random(61);
  const auto views = test::observe_views(setup, count, random);
  std::string poses = test::kPosesHeader, corners = "image,column,row,u_px,v_px\n";
  for (std::size_t i = 0; i < views.size(); ++i) {
    poses += fmt::format("{}.png,{}\n", i, test::numbers(views[i].base_T_flange.pose()));
    for (int c = 0; c < setup.board.corners(); ++c) {
      const auto& px = views[i].corners_px[static_cast<std::size_t>(c)];
      corners += test::corner_row(static_cast<int>(i), c, setup.board.inner_columns, px);
    }
  }
  folder.write("board.yaml", board_yaml(setup.board));
  folder.write("camera_info.yaml", test::camera_yaml(setup.camera));
  folder.write("poses.csv", poses);
  folder.write("corners.csv", corners);
  return views;
}

/// The fault and the words of reading a folder that must be refused.
void check_refused(const DataFolder& folder, Fault fault, const std::string& words) {
  const auto data = read_calibration_dataset(folder.path());
  REQUIRE_FALSE(data);
  CHECK(data.error().fault == fault);
  CHECK_THAT(std::string(data.error().detail()), Catch::Contains(words));
}

void write_png(const fs::path& file, const std::vector<std::uint8_t>& pixels, int width, int height,
               png_uint_32 format) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(width);
  png.height = static_cast<png_uint_32>(height);
  png.format = format;
  REQUIRE(png_image_write_to_file(&png, file.c_str(), 0, pixels.data(), 0, nullptr) != 0);
}

void write_jpeg(const fs::path& file, std::vector<std::uint8_t> pixels, int width, int height) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  std::FILE* stream = std::fopen(file.c_str(), "wb");
  REQUIRE(stream != nullptr);
  jpeg_stdio_dest(&info, stream);
  info.image_width = static_cast<JDIMENSION>(width);
  info.image_height = static_cast<JDIMENSION>(height);
  info.input_components = 1;
  info.in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, 95, TRUE);
  jpeg_start_compress(&info, TRUE);
  for (int v = 0; v < height; ++v) {
    JSAMPROW row = pixels.data() + static_cast<std::ptrdiff_t>(v) * width;
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  std::fclose(stream);
}

/// The folder of recorded data beside the checkout, when it is there.
std::optional<fs::path> franka() {
  const char* named = std::getenv("FIRSTLOOK_DATA");
  const fs::path data =
      named != nullptr ? fs::path(named) : fs::path(__FILE__).parent_path() / "../../../../shared/data";
  const fs::path folder = data / "hand_eye_franka";
  if (fs::is_directory(folder)) return folder;
  std::cout << "skipped: no recorded data at " << folder << " (set FIRSTLOOK_DATA)\n";
  return std::nullopt;
}

}  // namespace

TEST_CASE("a data set of corners is read and solved", "[app][calibration]") {
  const Setup setup;
  const DataFolder folder;
  const auto views = write_corners(folder, setup, 15);
  const auto data = read_calibration_dataset(folder.path());
  REQUIRE(data);
  CHECK(data->source == CalibrationSource::kCorners);
  CHECK(data->board == setup.board);
  CHECK(data->camera == setup.camera);
  REQUIRE(data->views.size() == 15);
  CHECK((data->views[3].corners_px[7] - views[3].corners_px[7]).norm() < 1e-6);
  CHECK(pose_difference(data->views[3].base_T_flange.pose(), views[3].base_T_flange.pose()).norm() < 1e-10);
  CHECK(data->names[3] == "3.png");
  const auto solvers = solver_names();
  for (std::size_t i = 0; i < solvers.size(); i += test::kTrialDivisor) {
    CAPTURE(solvers[i]);
    CHECK(run_calibrate_command({folder.path().string(), std::string(solvers[i]), true, true}) == 0);
  }
}

TEST_CASE("without camera_info.yaml the intrinsics come from the views", "[app][calibration]") {
  Setup setup;
  setup.distance_min_m = 0.35;
  setup.distance_max_m = 0.5;
  const DataFolder folder;
  write_corners(folder, setup, 20);
  fs::remove(folder.path() / "camera_info.yaml");
  const auto data = read_calibration_dataset(folder.path());
  REQUIRE(data);
  CHECK(data->intrinsics_estimated);
  CHECK(data->camera.fx == Approx(setup.camera.fx).epsilon(0.01));
  HandEyeOptions options;
  options.refinement.intrinsics = EstimatedIntrinsics::kWithoutK3;
  const auto result = calibrate_hand_eye(data->camera, data->board, data->views, options);
  REQUIRE(result);
  CHECK((result->flange_T_camera.translation() - setup.flange_T_camera.translation()).norm() < 1e-3);
  CHECK(result->camera.fx == Approx(setup.camera.fx).epsilon(0.002));

  // The command does the same, and what it writes is the estimated camera.
  CalibrateCommandOptions command{folder.path().string()};
  command.out = (folder.path() / "out").string();
  command.intrinsics = "given";
  CHECK(run_calibrate_command(command) == 2);  // none are
  command.intrinsics = "";
  CHECK(run_calibrate_command(command) == 0);
  const auto written = read_camera_info(folder.path() / "out" / "camera_info.yaml");
  REQUIRE(written);
  CHECK(written->fx == Approx(result->camera.fx).margin(1e-6));
  std::ifstream file(folder.path() / "out" / "result.json");
  const auto json = nlohmann::json::parse(file);
  CHECK(json["hand_eye"]["intrinsics"]["fx_px"].get<double>() == Approx(result->camera.fx).margin(1e-6));
  CHECK(json["hand_eye"]["intrinsics"]["sigma"]["k3"].is_null());
}

TEST_CASE("a data set of pose pairs is read and solved", "[app][calibration]") {
  const Setup setup;
  const DataFolder folder;
  Random random(62);
  std::string text = kPairsHeader;
  for (const PosePair& pair : test::observe_pairs(setup, 12, random)) {
    text += test::numbers(pair.base_T_flange.pose()) + "," + test::numbers(pair.camera_T_board.pose()) + "\n";
  }
  folder.write("pairs.csv", text);
  const auto data = read_calibration_dataset(folder.path());
  REQUIRE(data);
  CHECK(data->pairs.size() == 12);
  const auto result = calibrate_hand_eye_from_pairs(data->pairs);
  REQUIRE(result);
  CHECK((result->flange_T_camera.translation() - setup.flange_T_camera.translation()).norm() < 2e-3);
  CHECK(run_calibrate_command({folder.path().string(), "", false, true}) == 0);

  folder.write("pairs.csv", text + text.substr(kPairsHeader.size()));
  check_refused(folder, Fault::kDataMalformed, "pairs.csv:14: the same pair");
  folder.write("pairs.csv", kPairsHeader);
  check_refused(folder, Fault::kDataMalformed, "no pairs");
}

TEST_CASE("what is missing or malformed is named with file and line", "[app][calibration]") {
  const Setup setup;
  const DataFolder folder;
  CHECK(read_calibration_dataset("/nowhere/at/all").error().fault == Fault::kDataMissing);
  check_refused(folder, Fault::kDataMissing, "board.yaml");
  write_corners(folder, setup, 5);
  const std::string identity = ",0.1,0.2,0.3,0,0,0,1\n";

  folder.write("poses.csv", test::kPosesHeader + "0.png" + identity + "1.png,0.1,0.2,0.3,0,0,1\n");
  check_refused(folder, Fault::kDataMalformed, "poses.csv:3: 7 columns instead of 8");
  folder.write("poses.csv", test::kPosesHeader + "0.png,nan,0.2,0.3,0,0,0,1\n");
  check_refused(folder, Fault::kDataMalformed, "poses.csv:2: x is 'nan'");
  folder.write("poses.csv", test::kPosesHeader + "0.png,0.1,0.2,0.3,0,0,0,1.01\n");
  check_refused(folder, Fault::kDataMalformed, "poses.csv:2: a quaternion of length");
  folder.write("poses.csv", test::kPosesHeader + "0.png,0.1,0.2,0.3,0,0,0,0\n");
  check_refused(folder, Fault::kDataMalformed, "a quaternion of length");
  folder.write("poses.csv", test::kPosesHeader + "0.png,335,-32,308,0,0,0,1\n");
  check_refused(folder, Fault::kDataMalformed, "millimetres");
  folder.write("poses.csv", test::kPosesHeader + "0.png" + identity + "0.png" + identity);
  check_refused(folder, Fault::kDataMalformed, "poses.csv:3: image '0.png' a second time");
  folder.write("poses.csv", "image,x,y,z,qx,qy,qz\n");
  check_refused(folder, Fault::kDataMalformed, "no column 'qw'");
  folder.write("poses.csv", "");
  check_refused(folder, Fault::kDataMalformed, "empty");
  fs::remove(folder.path() / "poses.csv");
  check_refused(folder, Fault::kDataMissing, "poses.csv");

  write_corners(folder, setup, 5);
  folder.write("corners.csv", "image,column,row,u_px,v_px\n0.png,0,0,700,20\n");
  check_refused(folder, Fault::kDataMalformed, "corners.csv:2: corner at (700, 20) px lies outside");
  folder.write("corners.csv", "image,column,row,u_px,v_px\n0.png,8,0,70,20\n");
  check_refused(folder, Fault::kDataMalformed, "corner column 8");
  folder.write("corners.csv", "image,column,row,u_px,v_px\n0.png,1,0,70,20\n0.png,1,0,70,20\n");
  check_refused(folder, Fault::kDataMalformed, "corners.csv:3: this corner");
}

TEST_CASE("unusable boards and cameras are refused", "[app][calibration]") {
  const Setup setup;
  const DataFolder folder;
  write_corners(folder, setup, 5);
  folder.write("board.yaml", "type: checkerboard\ninner_columns: 8\ninner_rows: 6\nsquare_size_m: 0\n");
  check_refused(folder, Fault::kDataMalformed, "board.yaml:4");
  folder.write("board.yaml", "type: checkerboard\ninner_columns: 8\ninner_rows: 6\nsquare_size_m: 30\n");
  check_refused(folder, Fault::kDataMalformed, "millimetres");
  folder.write("board.yaml", "type: cheese\ninner_columns: 8\ninner_rows: 6\nsquare_size_m: 0.03\n");
  check_refused(folder, Fault::kDataMalformed, "charuco");  // one of those it names
  folder.write("board.yaml", "type: aruco\ncolumns: 8\nrows: 7\nspacing_m: 0.03\ndictionary: 4x4_50\n");
  check_refused(folder, Fault::kDataMalformed, "dictionary 4x4_50 ends with 49");
  folder.write("board.yaml", "type: checkerboard\ninner_columns: eight\ninner_rows: 6\nsquare_size_m: 0.03\n");
  check_refused(folder, Fault::kDataMalformed, "board.yaml:2");
  folder.write("board.yaml", "type: [checkerboard\n");
  check_refused(folder, Fault::kDataMalformed, "board.yaml");
  folder.write("board.yaml", board_yaml(setup.board));
  folder.write("camera_info.yaml", "image_width: 640\nimage_height: 480\n");
  check_refused(folder, Fault::kDataMalformed, "camera_matrix");
  CameraIntrinsics bad = setup.camera;
  bad.fx = -1;
  folder.write("camera_info.yaml", test::camera_yaml(bad));
  check_refused(folder, Fault::kDataMalformed, "camera_info.yaml:3");
}

TEST_CASE("pictures that are none are refused", "[app][calibration]") {
  const DataFolder folder;
  CHECK(read_gray_image(folder.path() / "none.png").error().fault == Fault::kDataMissing);
  folder.write("text.png", "not a picture at all");
  CHECK(read_gray_image(folder.path() / "text.png").error().fault == Fault::kDataMalformed);
  folder.write("cut.png", std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16));
  CHECK(read_gray_image(folder.path() / "cut.png").error().fault == Fault::kDataMalformed);
  folder.write("cut.jpg", std::string("\xFF\xD8\xFF\xE0\0\x10JFIF\0", 11));
  CHECK(read_gray_image(folder.path() / "cut.jpg").error().fault == Fault::kDataMalformed);
}

TEST_CASE("grey and colour PNG and JPEG come out as grey values", "[app][calibration]") {
  const DataFolder folder;
  std::vector<std::uint8_t> grey, colour;
  for (int i = 0; i < 40 * 30; ++i) {
    grey.push_back(static_cast<std::uint8_t>(40 + i % 40 * 4));
    for (int channel = 0; channel < 3; ++channel) colour.push_back(grey.back());
  }
  write_png(folder.path() / "grey.png", grey, 40, 30, PNG_FORMAT_GRAY);
  write_png(folder.path() / "colour.png", colour, 40, 30, PNG_FORMAT_RGB);
  write_jpeg(folder.path() / "grey.jpg", grey, 40, 30);
  CHECK(read_gray_image(folder.path() / "grey.png")->pixels == grey);
  for (const char* name : {"colour.png", "grey.jpg"}) {
    const auto picture = read_gray_image(folder.path() / name);
    REQUIRE(picture);
    CHECK(picture->width == 40);
    CHECK(picture->height == 30);
    for (std::size_t i = 0; i < grey.size(); ++i) CHECK(std::abs(picture->pixels[i] - grey[i]) <= 3);
  }
  // A JPEG cut short is not taken for a picture with a grey lower half.
  std::ifstream whole(folder.path() / "grey.jpg", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(whole)), std::istreambuf_iterator<char>());
  folder.write("short.jpg", bytes.substr(0, bytes.size() / 2));
  CHECK(read_gray_image(folder.path() / "short.jpg").error().fault == Fault::kDataMalformed);
}

TEST_CASE("images: a board that looks the same upside down, a board not seen, a wrong size", "[app][calibration]") {
  Setup setup;
  setup.roll_max_rad = 150 * test::kDegree;
  setup.arm_sigma = {1e-5, 1e-5};
  const DataFolder folder;
  Random random(63);
  std::string poses = test::kPosesHeader;
  for (int i = 0; i < 8; ++i) {
    const Pose camera_T_board = test::random_camera_T_board(setup, random);
    const auto image = test::draw_board(setup.camera, setup.board, camera_T_board);
    write_png(folder.path() / fmt::format("{}.png", i), image.pixels, image.width, image.height, PNG_FORMAT_GRAY);
    poses += fmt::format("{}.png,{}\n", i, test::numbers(test::flange_for(setup, camera_T_board)));
  }
  write_png(folder.path() / "wall.png", std::vector<std::uint8_t>(640 * 480, 90), 640, 480, PNG_FORMAT_GRAY);
  folder.write("poses.csv", poses + "wall.png,0.1,0.2,0.3,0,0,0,1\n");
  folder.write("board.yaml", board_yaml(setup.board));
  folder.write("camera_info.yaml", test::camera_yaml(setup.camera));
  const auto data = read_calibration_dataset(folder.path());
  REQUIRE(data);
  CHECK(data->views.size() == 8);
  CHECK_THAT(data->notes.front(), Catch::Contains("wall.png: left out"));
  const auto result = calibrate_hand_eye(data->camera, data->board, data->views);
  REQUIRE(result);
  CHECK(result->views == 8);
  CHECK((result->flange_T_camera.translation() - setup.flange_T_camera.translation()).norm() < 2e-3);

  CameraIntrinsics other = setup.camera;
  other.width = 800;
  folder.write("camera_info.yaml", test::camera_yaml(other));
  check_refused(folder, Fault::kDataMalformed, "0.png: 640x480 pixels, but camera_info.yaml has 800x480");
  folder.write("camera_info.yaml", test::camera_yaml(setup.camera));
  folder.write("poses.csv", test::kPosesHeader + "wall.png,0.1,0.2,0.3,0,0,0,1\n");
  check_refused(folder, Fault::kBoardNotFound, "in none of 1 images");
  folder.write("poses.csv", test::kPosesHeader + "gone.png,0.1,0.2,0.3,0,0,0,1\n");
  check_refused(folder, Fault::kDataMissing, "gone.png");
}

TEST_CASE("calibrate --out leaves what a run leaves of its calibration", "[app][calibration]") {
  const Setup setup;
  const DataFolder folder;
  write_corners(folder, setup, 15);
  CalibrateCommandOptions options;
  options.dataset = folder.path().string();
  options.strict = options.json = true;
  options.out = (folder.path() / "result").string();
  options.arm = "ur5e";
  REQUIRE(run_calibrate_command(options) == 0);
  CHECK(run_calibrate_command(options) == 3);  // a folder that is not empty stays as it is
  const fs::path out = options.out;
  const auto stored = read_hand_eye(out / "hand_eye.yaml");
  if (!stored) FAIL(stored.error().detail());
  CHECK(check_belongs(*stored, *find_arm_model("ur5e"), setup.camera, {}));
  CHECK(stored->views == 15);
  CHECK(*read_camera_info(out / "camera_info.yaml") == setup.camera);
  const Pose pose = stored->flange_T_camera.pose();
  const YAML::Node easy = YAML::LoadFile((out / "ros/easy_handeye.yaml").string())["transformation"];
  CHECK(easy["x"].as<double>() == Approx(pose.translation().x()).margin(1e-11));
  for (const char* name :
       {"easy_handeye2.calib", "camera_transform.launch", "camera_transform.launch.py", "camera.xacro"}) {
    CHECK(fs::file_size(out / "ros" / name) > 200);
  }
  CHECK(std::distance(fs::recursive_directory_iterator(out), fs::recursive_directory_iterator()) == 10);
}

TEST_CASE("calibrate --out: pose pairs know no camera, and nothing for ROS is made of a rejected one",
          "[app][calibration]") {
  const Setup setup;
  const DataFolder folder;
  Random random(62);
  std::string rows = kPairsHeader;
  for (int i = 0; i < 20; ++i) {
    const Pose camera_T_board = test::random_camera_T_board(setup, random);
    rows += test::numbers(test::flange_for(setup, camera_T_board)) + "," + test::numbers(camera_T_board) + "\n";
  }
  folder.write("pairs.csv", rows);
  CalibrateCommandOptions options;
  options.dataset = folder.path().string();
  options.out = (folder.path() / "pairs").string();
  REQUIRE(run_calibrate_command(options) == 0);
  CHECK_FALSE(fs::exists(folder.path() / "pairs/camera_info.yaml"));
  const auto stored = read_hand_eye(folder.path() / "pairs/hand_eye.yaml");
  if (!stored) FAIL(stored.error().detail());
  CHECK(stored->intrinsics.width == 0);
  CHECK(stored->arm_model == kUnknownArm);
  CHECK((stored->flange_T_camera.translation() - setup.flange_T_camera.translation()).norm() < 1e-3);

  const DataFolder few;
  write_corners(few, setup, 4);  // solved, too few views to be trusted
  options.dataset = few.path().string();
  options.out = (few.path() / "rejected").string();
  REQUIRE(run_calibrate_command(options) == 0);
  CHECK(read_hand_eye(few.path() / "rejected/hand_eye.yaml").error().fault == Fault::kStoredCalibration);
  CHECK_FALSE(fs::exists(few.path() / "rejected/ros"));
  options.out = (few.path() / "board.yaml").string();
  CHECK(run_calibrate_command(options) == 3);  // a file, not a folder
  options.arm = "puma";
  CHECK(run_calibrate_command(options) == 2);
}

TEST_CASE("exit codes of the command", "[app][calibration]") {
  const Setup setup;
  const DataFolder folder;
  CHECK(run_calibrate_command({"", "", false, false}) == 2);
  CHECK(run_calibrate_command({folder.path().string(), "daniilides", false, false}) == 2);
  CHECK(run_calibrate_command({folder.path().string(), "", false, false}) == 3);
  write_corners(folder, setup, 4);  // solved, too few views to be trusted
  CHECK(run_calibrate_command({folder.path().string(), "", false, false}) == 0);
  CHECK(run_calibrate_command({folder.path().string(), "", true, false}) == 5);
  write_corners(folder, setup, 2);
  CHECK(run_calibrate_command({folder.path().string(), "", false, false}) == 3);
}

TEST_CASE("the recorded Franka set gives its published transform, with honest sigmas", "[app][calibration]") {
  const auto folder = franka();
  if (!folder) return;
  const auto data = read_calibration_dataset(*folder);
  REQUIRE(data);
  REQUIRE(data->views.size() == 8);
  const auto result = calibrate_hand_eye(data->camera, data->board, data->views);
  REQUIRE(result);
  const Eigen::Vector3d published(0.0577, -0.0339, -0.0423);
  CHECK((result->flange_T_camera.translation() - published).norm() < 1.5e-3);
  CHECK(result->views == 8);
  // The set is consistent to about 4.5 mm only: arm sigma and hand-eye sigma must say so.
  CHECK(result->arm_sigma.translation_m > 1e-3);
  CHECK(result->sigma_translation_m.maxCoeff() > 1e-3);
  CHECK(result->sigma_translation_m.maxCoeff() < 1e-2);
  CHECK(result->verdict == Verdict::kRejected);
  CHECK(result->board_in_base.rotation_rms_deg == Approx(0.456).margin(0.02));
  CHECK(result->board_in_base.translation_rms_mm == Approx(5.41).margin(0.15));

  // Without any one of the views the answer stays within what the sigmas say.
  for (std::size_t out = 0; out < 8; ++out) {
    auto views = data->views;
    views.erase(views.begin() + static_cast<std::ptrdiff_t>(out));
    const auto less = solve_hand_eye(data->camera, data->board, views);
    REQUIRE(less);
    CHECK((less->flange_T_camera.translation() - published).norm() < 3 * result->sigma_translation_m.norm());
  }
}

TEST_CASE("boards of markers: half of the points in each view, from corners and from images", "[app][calibration]") {
  Setup setup;
  setup.board = {5, 4, 0.055, TargetType::kMarkerGrid, 0.044, MarkerDictionary::kAprilTag36h11};
  Random random(64);
  std::vector<CalibrationView> views = test::observe_views(setup, 15, random);
  std::string poses = test::kPosesHeader, corners = "image,point,u_px,v_px\n";
  for (std::size_t i = 0; i < views.size(); ++i) {
    poses += fmt::format("{}.png,{}\n", i, test::numbers(views[i].base_T_flange.pose()));
    for (int c = 0; c < setup.board.corners(); ++c) {
      if ((c / 4 + static_cast<int>(i)) % 2 == 0) continue;  // every second marker is hidden
      const auto& px = views[i].corners_px[static_cast<std::size_t>(c)];
      corners += fmt::format("{}.png,{},{:.9g},{:.9g}\n", i, c, px.x(), px.y());
    }
  }
  const DataFolder folder;
  folder.write("board.yaml", board_yaml(setup.board));
  folder.write("camera_info.yaml", test::camera_yaml(setup.camera));
  folder.write("poses.csv", poses);
  folder.write("corners.csv", corners);
  const auto data = read_calibration_dataset(folder.path());
  REQUIRE(data);
  CHECK(data->board == setup.board);
  REQUIRE(data->views.size() == 15);
  CHECK(data->views[0].ids.size() == 40);
  const auto result = calibrate_hand_eye(data->camera, data->board, data->views);
  REQUIRE(result);
  const Vector6d off = pose_difference(setup.flange_T_camera, result->flange_T_camera.pose());
  CHECK(off.dot(result->covariance.ldlt().solve(off)) < 22.5);  // 99.9 % of a chi squared of 6
  CHECK(off.head<3>().norm() < 0.001);
  CHECK(result->reprojection_rms_px == Approx(0.1).margin(0.02));

  folder.write("corners.csv", corners + "0.png,80,10,10\n");
  check_refused(folder, Fault::kDataMalformed, "point 80 on a board with 80");
}

TEST_CASE("board.yaml is read as it was written, for every type", "[app][calibration]") {
  const DataFolder folder;
  for (const BoardSpec& board :
       {BoardSpec{9, 6, 0.0236}, BoardSpec{4, 11, 0.02, TargetType::kAsymmetricCircles, 0.016},
        BoardSpec{6, 5, 0.04, TargetType::kCharuco, 0.031, MarkerDictionary::k5x5_100, 3, true},
        BoardSpec{1, 1, 0.1, TargetType::kMarkerGrid, 0.1, MarkerDictionary::kAprilTag25h9, 4},
        BoardSpec{3, 2, 0.07, TargetType::kMarkerGrid, 0.05, MarkerDictionary::kArtoolkitPlusBch, 4},
        BoardSpec{1, 1, 0.08, TargetType::kPatternMarker, 0.08}}) {
    folder.write("board.yaml", board_yaml(board));
    const auto again = read_board(folder.path() / "board.yaml");
    CAPTURE(board_yaml(board));
    REQUIRE(again);
    CHECK(*again == board);
  }
}
