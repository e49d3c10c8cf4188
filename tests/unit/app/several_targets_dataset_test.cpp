/// Recorded data with several targets, and the report of a calibration from recorded data.
#include <png.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "algorithms/calibration/verdict.hpp"
#include "app/cli/calibrate_command.hpp"
#include "app/dataset/calibration_dataset.hpp"
#include "tests/support/recorded_data.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"
#include "tests/unit/vision/draw_board.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using test::DataFolder;
using test::Setup;
namespace fs = std::filesystem;

namespace {

const std::string kDoor =
    "  - name: door\n    type: checkerboard\n    inner_columns: 8\n    inner_rows: 6\n    square_size_m: 0.03\n";
const std::string kTable =
    "  - {name: table, type: apriltag, columns: 3, rows: 2, spacing_m: 0.06, mark_size_m: 0.045, first_id: 4}\n";

/// Two targets side by side; of the second the corners of markers.
struct Cell {
  Setup door, table;
  Cell() {
    table.board = {3, 2, .06, TargetType::kMarkerGrid, .045, MarkerDictionary::kAprilTag36h11, 4};
    table.base_T_board.translate(Eigen::Vector3d(0.27, 0.0, 0.02));
  }
};

/// Every third picture shows both, the others one of the two. Corners outside the image are not written, so that a
/// checkerboard that is not whole is left out.
void write_cell(const DataFolder& folder, const Cell& cell, int pictures) {
  Random random(71);
  std::string poses = test::kPosesHeader, corners = "target,image,point,u_px,v_px\n";
  for (int i = 0; i < pictures; ++i) {
    const Setup& looked_at = i % 3 == 1 ? cell.table : cell.door;
    const Pose flange = test::flange_for(looked_at, test::random_camera_T_board(looked_at, random));
    poses += fmt::format("{}.png,{}\n", i, test::numbers(flange));
    for (const auto& [name, setup] : {std::pair{"door", &cell.door}, {"table", &cell.table}}) {
      if (i % 3 != 2 && setup != &looked_at) continue;
      const CalibrationView view = test::observe(*setup, flange, random);
      for (std::size_t c = 0; c < view.corners_px.size(); ++c) {
        const Eigen::Vector2d& px = view.corners_px[c];
        if (px.x() < 0 || px.y() < 0 || px.x() > setup->camera.width - 1 || px.y() > setup->camera.height - 1) continue;
        corners += fmt::format("{},{}.png,{},{:.9g},{:.9g}\n", name, i, c, px.x(), px.y());
      }
    }
  }
  folder.write("board.yaml", "boards:\n" + kDoor + kTable);
  folder.write("camera_info.yaml", test::camera_yaml(cell.door.camera));
  folder.write("poses.csv", poses);
  folder.write("corners.csv", corners);
}

void check_refused(const DataFolder& folder, const std::string& words) {
  const auto data = read_calibration_dataset(folder.path());
  REQUIRE_FALSE(data);
  CHECK(data.error().fault == Fault::kDataMalformed);
  CHECK_THAT(std::string(data.error().detail()), Contains(words));
}

void write_png(const fs::path& file, const test::DrawnImage& image) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_GRAY;
  REQUIRE(png_image_write_to_file(&png, file.c_str(), 0, image.pixels.data(), 0, nullptr) != 0);
}

}  // namespace

TEST_CASE("corners of two targets in any subset are read and solved together", "[app][calibration]") {
  const Cell cell;
  const DataFolder folder;
  write_cell(folder, cell, 18);
  const auto data = read_calibration_dataset(folder.path());
  if (!data) FAIL(data.error().detail());
  REQUIRE(data->targets.size() == 2);
  CHECK(data->targets[1].name == "table");
  CHECK(data->targets[1].board == cell.table.board);
  std::array<int, 2> seen{};
  int together = 0;
  for (std::size_t i = 0; i < data->views.size(); ++i) {
    ++seen[static_cast<std::size_t>(data->views[i].target)];
    if (i > 0 && data->views[i].station == data->views[i - 1].station) ++together;
  }
  CHECK(seen[0] >= 10);
  CHECK(seen[1] >= 7);
  CHECK(together >= 2);
  CHECK_THAT(data->names.front(), Contains("0.png, door"));

  const auto result = calibrate_hand_eye(data->camera, boards_of(data->targets), data->views);
  REQUIRE(result);
  CHECK(result->verdict == Verdict::kAccepted);
  const auto error = [](const Pose& truth, const Pose& estimate, const Matrix6d& covariance) {
    const Vector6d e = pose_difference(truth, estimate);
    return e.dot(covariance.inverse() * e);
  };
  CHECK(error(cell.door.flange_T_camera, result->flange_T_camera.pose(), result->covariance) < 22.5);
  const auto mutual = mutual_pose(result->targets, result->joint_covariance, 0, 1);
  REQUIRE(mutual);
  const Pose truth = cell.door.base_T_board.inverse(Eigen::Isometry) * cell.table.base_T_board;
  CHECK(error(truth, mutual->pose.pose(), mutual->covariance) < 22.5);
}

TEST_CASE("calibrate --out writes a page and figures of several targets, the same each time", "[app][calibration]") {
  const DataFolder folder;
  write_cell(folder, Cell(), 12);
  CalibrateCommandOptions options;
  options.dataset = folder.path().string();
  options.json = true;
  for (const char* name : {"first", "second"}) {
    options.out = (folder.path() / name).string();
    REQUIRE(run_calibrate_command(options) == 0);
  }
  const std::string page = folder.read("first/report.html");
  CHECK(page == folder.read("second/report.html"));
  for (const char* words : {"Where the targets are", "Every solver on parts of the views", "How far each view is off",
                            "2.png, table", "park-martin", "yaw, degrees"}) {
    CHECK_THAT(page, Contains(words));
  }
  CHECK(page.find("://") == std::string::npos);
  CHECK(page.find("<script") == std::string::npos);

  auto json = nlohmann::json::parse(folder.read("first/result.json"));
  auto again = nlohmann::json::parse(folder.read("second/result.json"));
  json.erase("wall");
  again.erase("wall");
  CHECK(json == again);
  CHECK(json["cell"] == folder.path().filename().string());
  CHECK(json["mapping"].is_null());
  const auto& hand_eye = json["hand_eye"];
  REQUIRE(hand_eye["targets"].size() == 2);
  CHECK(hand_eye["targets"][1]["name"] == "table");
  CHECK(hand_eye["targets"][1]["base_T_board"]["translation_m"].size() == 3);
  REQUIRE(hand_eye["mutual_poses"].size() == 1);
  CHECK(hand_eye["mutual_poses"][0]["from"] == "door");
  CHECK(hand_eye["mutual_poses"][0]["translation_m"][0].get<double>() == Approx(0.27).margin(5e-3));
  CHECK(hand_eye["mutual_poses"][0]["sigma_translation_mm"][0].get<double>() > 0);
  const auto& comparison = hand_eye["solver_comparison"];
  CHECK(comparison["subsets"] == 100);
  REQUIRE(comparison["solvers"].size() == solver_table().size() + 1);
  CHECK(comparison["solvers"][0]["solver"] == "refinement");
  const auto x = comparison["solvers"][0]["x_m"].get<std::vector<double>>();
  REQUIRE(x.size() == 5);
  CHECK(std::is_sorted(x.begin(), x.end()));
}

TEST_CASE("a target that one picture shows is kept, one that none shows is dropped, both with a note",
          "[app][calibration]") {
  const DataFolder folder;
  write_cell(folder, Cell(), 12);
  std::string kept;
  std::istringstream lines(folder.read("corners.csv"));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("table,") || line.starts_with("table,4.png")) kept += line + "\n";
  }
  folder.write("corners.csv", kept);
  folder.write("board.yaml",
               "boards:\n" + kDoor + kTable + "  - {name: shelf, type: marker, mark_size_m: 0.1, first_id: 40}\n");
  const auto data = read_calibration_dataset(folder.path());
  if (!data) FAIL(data.error().detail());
  std::string notes;
  for (const std::string& note : data->notes) notes += note + "\n";
  CHECK_THAT(notes, Contains("table: seen in one view") && Contains("shelf: dropped, no view shows it"));
  const auto result = solve_hand_eye(data->camera, boards_of(data->targets), data->views);
  REQUIRE(result);
  CHECK(result->targets[1].views == 1);
  CHECK(result->targets[2].views == 0);
}

TEST_CASE("what is wrong with a list of boards or the column of targets is named", "[app][calibration]") {
  const DataFolder folder;
  write_cell(folder, Cell(), 6);
  const auto boards = [&](const std::string& list) { folder.write("board.yaml", list); };
  boards("boards:\n" + kDoor +
         "  - {name: wall, type: checkerboard, inner_columns: 6, inner_rows: 8, square_size_m: 0.05}\n");
  check_refused(folder, "board.yaml:7: 'door' and 'wall' could be taken for each other");
  boards("boards:\n" + kTable + "  - {name: cup, type: marker, mark_size_m: 0.05, first_id: 7}\n");
  check_refused(folder, "marker 7 of apriltag_36h11 is on both");
  boards("boards:\n" + kDoor + kDoor);
  check_refused(folder, "two targets are named 'door'");
  boards("boards:\n  - {type: checkerboard, inner_columns: 6, inner_rows: 8, square_size_m: 0.05}\n");
  check_refused(folder, "no key 'name'");
  boards("boards: []\n");
  check_refused(folder, "no board in the list");
  boards("type: checkerboard\nboards:\n" + kDoor);
  check_refused(folder, "put that one into the list");
  boards("boards:\n" + kDoor + kTable);
  folder.write("corners.csv", "target,image,point,u_px,v_px\nwindow,0.png,0,10,10\n");
  check_refused(folder, "corners.csv:2: no target 'window'");
  folder.write("corners.csv", "image,point,u_px,v_px\n0.png,0,10,10\n");
  check_refused(folder, "target");
}

TEST_CASE("pictures give the targets that they show", "[app][calibration]") {
  const Cell cell;
  const DataFolder folder;
  Random random(72);
  std::string poses = test::kPosesHeader;
  for (int i = 0; i < 4; ++i) {
    const Setup& setup = i % 2 == 0 ? cell.door : cell.table;
    const Pose camera_T_board = test::random_camera_T_board(setup, random);
    const std::string name = fmt::format("{}.png", i);
    write_png(folder.path() / name, test::draw_board(setup.camera, setup.board, camera_T_board));
    poses += fmt::format("{},{}\n", name, test::numbers(test::flange_for(setup, camera_T_board)));
  }
  write_png(folder.path() / "wall.png", {std::vector<std::uint8_t>(640 * 480, 130), 640, 480});
  poses += fmt::format("wall.png,{}\n", test::numbers(Pose::Identity()));
  folder.write("board.yaml", "boards:\n" + kDoor + kTable);
  folder.write("camera_info.yaml", test::camera_yaml(cell.door.camera));
  folder.write("poses.csv", poses);
  const auto data = read_calibration_dataset(folder.path());
  if (!data) FAIL(data.error().detail());
  CHECK(data->names == std::vector<std::string>{"0.png, door", "1.png, table", "2.png, door", "3.png, table"});
  CHECK(data->images[3] == "3.png");
  REQUIRE_FALSE(data->notes.empty());
  CHECK_THAT(data->notes.front(), Contains("wall.png: left out, it shows none of 2 targets"));
}
