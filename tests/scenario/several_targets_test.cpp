/// `firstlook calibrate` on recorded data of two boards that are never in one picture.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/run_program.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

namespace firstlook {
namespace {

namespace fs = std::filesystem;
using test::Setup;

struct Cell {
  Setup near, far;
  Cell() {
    far.board = {7, 4, 0.04};
    far.base_T_board.translate(Eigen::Vector3d(-0.7, 0.6, 0.2)).rotate(rotation_exp({0.9, -0.3, 0.2}));
  }
};

void write_data(const fs::path& folder, const Cell& cell) {
  fs::create_directories(folder);
  std::ofstream(folder / "board.yaml")
      << "boards:\n  - {name: near, type: checkerboard, inner_columns: 8, inner_rows: 6, square_size_m: 0.03}\n"
         "  - {name: far, type: checkerboard, inner_columns: 7, inner_rows: 4, square_size_m: 0.04}\n";
  const CameraIntrinsics& c = cell.near.camera;
  std::ofstream(folder / "camera_info.yaml") << fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_matrix: {{rows: 3, cols: 3, data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]}}\n"
      "distortion_model: plumb_bob\ndistortion_coefficients: {{rows: 1, cols: 5, data: [{}, {}, {}, {}, {}]}}\n",
      c.width, c.height, c.fx, c.cx, c.fy, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3);
  std::ofstream poses(folder / "poses.csv"), corners(folder / "corners.csv");
  poses << "image,x,y,z,qx,qy,qz,qw\n";
  corners << "image,target,column,row,u_px,v_px\n";
  Random random(81);
  for (int i = 0; i < 20; ++i) {
    const Setup& setup = i % 2 == 0 ? cell.near : cell.far;
    const auto view = test::observe_views(setup, 1, random).front();
    const Eigen::Vector3d t = view.base_T_flange.translation();
    const Eigen::Quaterniond q = view.base_T_flange.quaternion();
    poses << fmt::format("{}.png,{},{},{},{},{},{},{}\n", i, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
    for (int k = 0; k < setup.board.corners(); ++k) {
      const Eigen::Vector2d& px = view.corners_px[static_cast<std::size_t>(k)];
      corners << fmt::format("{}.png,{},{},{},{},{}\n", i, i % 2 == 0 ? "near" : "far", k % setup.board.inner_columns,
                             k / setup.board.inner_columns, px.x(), px.y());
    }
  }
}

}  // namespace

TEST_CASE("calibrate: two boards never seen together give one hand-eye and their mutual pose", "[scenario]") {
  const fs::path folder = fs::temp_directory_path() / "firstlook_scenario_targets";
  fs::remove_all(folder);
  const Cell cell;
  write_data(folder / "data", cell);
  const auto run = [&](const std::string& out) {
    return test::run_program(FIRSTLOOK_PROGRAM, {"calibrate", "--dataset", (folder / "data").string(), "--out",
                                                 (folder / out).string(), "--strict", "--json"});
  };
  const test::ProgramResult first = run("first"), second = run("second");
  INFO(first.err);
  REQUIRE(first.exit_code == 0);
  CHECK(first.out == second.out);
  const auto json = nlohmann::json::parse(first.out);
  CHECK(json["verdict"] == "accepted");
  CHECK(json["views"] == 20);
  REQUIRE(json["mutual_poses"].size() == 1);
  const auto& mutual = json["mutual_poses"][0];
  const Eigen::Vector3d truth = (cell.near.base_T_board.inverse(Eigen::Isometry) * cell.far.base_T_board).translation();
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    const double sigma_m = 1e-3 * mutual["sigma_translation_mm"][at].get<double>();
    CHECK(std::abs(mutual["translation_m"][at].get<double>() - truth[axis]) < 4.5 * sigma_m);
    CHECK(sigma_m < 2e-3);
  }
  for (const char* name : {"report.html", "result.json", "hand_eye.yaml", "ros/camera.xacro"}) {
    CHECK(fs::file_size(folder / "first" / name) > 500);
  }

  // The same board twice cannot be told apart: refused before anything is read, with the remedy.
  std::ofstream(folder / "data/board.yaml")
      << "boards:\n  - {name: near, type: checkerboard, inner_columns: 8, inner_rows: 6, square_size_m: 0.03}\n"
         "  - {name: far, type: checkerboard, inner_columns: 8, inner_rows: 6, square_size_m: 0.04}\n";
  const test::ProgramResult refused = run("third");
  CHECK(refused.exit_code == 3);
  CHECK_THAT(refused.err, Catch::Contains("board.yaml:3: 'near' and 'far'") && Catch::Contains("other counts"));
  fs::remove_all(folder);
}

}  // namespace firstlook
